//! Noise of the wheels that is none, or says that they say nothing.

use coloc_drivers::encoder::Rounded;

use super::super::finding::Finding;
use super::super::{Config, Variance};
use super::list;

/// Odometry with σ so many times the highest speed says nothing.
const USELESS: f64 = 10.0;

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let mut found = Vec::new();
    if let Some(odometry) = &config.odometry {
        found.extend(perfect(config));
        let sideways =
            odometry.moves_sideways() && !odometry.base.as_ref().is_some_and(|it| it.sideways);
        found.extend(
            sideways
                .then(|| is_perfect("sideways", config.motion.sideways, "sideways"))
                .flatten(),
        );
        found.extend(useless(config, odometry.max_speed_mps));
    }
    found.extend(outage(config));
    found.extend(creep(config));
    found
}

fn perfect(config: &Config) -> impl Iterator<Item = Finding> {
    let motion = &config.motion;
    [
        is_perfect("forward", motion.forward, "along its way"),
        is_perfect("turning", motion.turning, "in its heading"),
    ]
    .into_iter()
    .flatten()
}

fn is_perfect(key: &str, variance: Variance, what: &str) -> Option<Finding> {
    let problem = format!(
        ": has no noise at all: the robot never becomes less certain {what}, however far it drives"
    );
    (variance == Variance::default()).then(|| Finding::new(format!("motion.{key}"), problem))
}

fn useless(config: &Config, max_speed_mps: f64) -> Option<Finding> {
    let forward = config.motion.noise().forward;
    let sigma = forward.at(max_speed_mps, max_speed_mps, 0.0).sqrt();
    let problem = format!(
        ": makes σ = {} m/s of a speed of {max_speed_mps} m/s: are these variances, per reference_period_s?",
        Rounded(sigma)
    );
    (sigma > USELESS * max_speed_mps).then(|| Finding::new("motion.forward", problem))
}

fn outage(config: &Config) -> Option<Finding> {
    let variances = &config.motion.outage_variance;
    let problem = format!(
        " = {}: zero says that a robot without odometry stands still exactly, however long",
        list(variances)
    );
    variances
        .contains(&0.0)
        .then(|| Finding::new("motion.outage_variance", problem))
}

/// What creeps farther in an hour than that is not parked \[m, m, rad\].
const FARTHEST_CREEP: [f64; 3] = [10.0, 10.0, 0.5];

fn creep(config: &Config) -> Option<Finding> {
    let creep = config.motion.creep_per_hour;
    let problem = format!(
        " = {}: is more than 10 m or 0.5 rad in an hour of standing: is it in metres and radians, and of an hour?",
        list(&creep)
    );
    let is_far = creep
        .into_iter()
        .zip(FARTHEST_CREEP)
        .any(|(it, most)| it > most);
    is_far.then(|| Finding::new("motion.creep_per_hour", problem))
}
