//! Times that do not fit one another.

use coloc_drivers::encoder::{Time, describe};

use super::super::Config;
use super::super::finding::Finding;

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let frames_s = frames_s(config);
    [
        history(config),
        future(config),
        hold(config, frames_s),
        long_hold(config),
        never_resumed(config),
        stale_odometry(config, frames_s),
    ]
    .into_iter()
    .flatten()
    .chain(stale(config))
    .collect()
}

/// Time between two frames of the slowest message that is waited for \[s\].
#[expect(clippy::cast_precision_loss, reason = "ten seconds at most")]
fn frames_s(config: &Config) -> Option<f64> {
    let description = describe(config.odometry.as_ref()?).ok()?;
    let periods = description.expected.iter().map(|it| it.period_us);
    periods.max().map(|us| us as f64 * 1e-6)
}

fn history(config: &Config) -> Option<Finding> {
    let (length_s, rate_hz) = (config.history.length_s, config.tick.rate_hz);
    let problem = format!(
        " = {length_s}: is less than two ticks' periods at {rate_hz} Hz: what came right after a tick is rejected as too old when \
         the next one is late"
    );
    (length_s * rate_hz < 2.0).then(|| Finding {
        or: &["tick.rate_hz"],
        ..Finding::new("history.length_s", problem)
    })
}

fn future(config: &Config) -> Option<Finding> {
    let problem = " = 0: rejects the word of a sender whose clock is ahead by a microsecond";
    (config.history.future_tolerance_s == 0.0)
        .then(|| Finding::new("history.future_tolerance_s", problem))
}

fn hold(config: &Config, frames_s: Option<f64>) -> Option<Finding> {
    let (hold_s, frames_s) = (config.motion.hold_s, frames_s?);
    let problem = format!(
        " = {hold_s}: is less than two frames take, {}: after a single frame that is lost the robot is taken to stand",
        Time(2.0 * frames_s)
    );
    (hold_s < 2.0 * frames_s).then(|| Finding::new("motion.hold_s", problem))
}

/// Longer than that no robot drives blindly and straight on \[s\].
const LONGEST_HOLD_S: f64 = 5.0;

fn long_hold(config: &Config) -> Option<Finding> {
    let hold_s = config.motion.hold_s;
    let problem = format!(
        " = {hold_s}: for so long a robot whose encoders fall silent is taken to drive on as before"
    );
    (hold_s > LONGEST_HOLD_S).then(|| Finding::new("motion.hold_s", problem))
}

fn never_resumed(config: &Config) -> Option<Finding> {
    let initial = &config.initial;
    let problem = " = 0: no saved belief is so young: initial.resume = false says it plainly";
    (initial.resume && initial.resume_max_age_s == 0.0)
        .then(|| Finding::new("initial.resume_max_age_s", problem))
}

fn stale_odometry(config: &Config, frames_s: Option<f64>) -> Option<Finding> {
    let (stale_s, frames_s) = (config.health.odometry_stale_s, frames_s?);
    let problem = format!(
        " = {stale_s}: is less than the time between two frames, {}: odometry is stale most of the time",
        Time(frames_s)
    );
    (stale_s < frames_s).then(|| Finding::new("health.odometry_stale_s", problem))
}

fn stale(config: &Config) -> impl Iterator<Item = Finding> {
    let (health, period_s) = (&config.health, 1.0 / config.tick.rate_hz);
    [
        ("relative_pose_stale_s", health.relative_pose_stale_s),
        ("position_stale_s", health.position_stale_s),
        ("neighbours_stale_s", health.neighbours_stale_s),
    ]
    .into_iter()
    .filter(move |(_, stale_s)| *stale_s < period_s)
    .map(move |(key, stale_s)| {
        let problem = format!(
            " = {stale_s}: is less than a tick's period, {}: hardly anything is ever fresh",
            Time(period_s)
        );
        Finding::new(format!("health.{key}"), problem)
    })
}
