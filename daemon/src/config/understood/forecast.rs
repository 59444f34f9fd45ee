//! What the configured noise makes of a robot's certainty, by the estimator itself.

use coloc_drivers::encoder::{OdometryConfig, Quantity, Rest};
use coloc_estimator::{
    Belief, Covariance3, Motion, OdometrySample, Pose, Span, Stamp, Start, TickInputs,
};

use super::super::{Config, nanos};
use crate::collect::wheels::ToMotion;
use crate::estimate::Estimate;

/// Standard deviations of a robot that knew everything at the start.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Doubt {
    pub(super) along_m: f64,
    pub(super) across_m: f64,
    pub(super) heading_rad: f64,
}

/// After 100 m straight on.
pub(super) fn straight(config: &Config, speed_mps: f64) -> Doubt {
    let motion = ToMotion::new(config).motion([speed_mps, 0.0, 0.0]);
    after(config, motion, 100.0 / speed_mps)
}

/// After an hour in which every encoder said, as well as it can, that it stands.
pub(super) fn standing(config: &Config) -> Doubt {
    let to_motion = ToMotion::new(config);
    let counts = config.odometry.as_ref().is_some_and(counts);
    let rest = if counts { Rest::Counts } else { Rest::Speeds };
    let standing = to_motion.standing(rest);
    let motion = standing.unwrap_or_else(|| to_motion.motion([0.0; 3]));
    after(config, motion, 3600.0)
}

/// Whether counts or distances are heard, not speeds alone.
pub(super) fn counts(odometry: &OdometryConfig) -> bool {
    let mut wheels = odometry.each_wheel().peekable();
    let of_wheels =
        wheels.peek().is_some() && wheels.all(|wheel| wheel.quantity == Quantity::CumulativeTicks);
    let of_base = odometry.base.as_ref().and_then(|base| base.track_m);
    of_wheels || of_base.is_some()
}

/// After so long in at least a thousand samples, none of them longer than the history.
fn after(config: &Config, motion: Motion, duration_s: f64) -> Doubt {
    let certain = Belief::independent(Pose::default(), Covariance3::ZERO);
    let mut estimate = Estimate::new(config, Stamp::default(), &Start::Known(certain));
    let longest_s = (duration_s / 1000.0).min(config.history.length_s / 2.0);
    let period = Span::from_nanos(nanos(longest_s).max(1));
    let (mut start, end) = (
        Stamp::default(),
        Stamp::default() + Span::from_nanos(nanos(duration_s)),
    );
    let mut variances = [0.0; 3];
    while start < end {
        let stamp = end.min(start + period);
        variances = drive(&mut estimate, motion, start, stamp);
        start = stamp;
    }
    let [along_m, across_m, heading_rad] = variances.map(f64::sqrt);
    Doubt {
        along_m,
        across_m,
        heading_rad,
    }
}

fn drive(estimate: &mut Estimate, motion: Motion, start: Stamp, stamp: Stamp) -> [f64; 3] {
    let sample = OdometrySample {
        source: 0,
        start,
        stamp,
        motion,
    };
    let outputs = estimate.step(&TickInputs {
        stamp,
        measurements: &[sample.into()],
    });
    outputs.estimate.belief.total().variances()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::super::StandsBy;
    use super::*;

    fn config(motion: &str) -> Config {
        let wheel = |message: &str| {
            format!("{{ message = \"{message}\", signal = \"Ticks\", metres_per_tick = 1e-4 }}")
        };
        let text = format!(
            "[robot]\nname = \"a\"\nid = 1\n[odometry]\nbuses = [\"local:/tmp/bus\"]\nmax_speed_mps = 2.0\n\
             [odometry.wheels]\ntrack_m = 0.3\nleft = {}\nright = {}\n[motion]\n{motion}\n",
            wheel("WheelLeft"),
            wheel("WheelRight")
        );
        Config::parse(&text, Path::new("a.toml")).unwrap()
    }

    /// By the integrals of white noise, the heading's angle being small: along, across, heading.
    fn integrated(config: &Config, speed_mps: f64) -> [f64; 3] {
        let way_m = 100.0;
        let duration_s = way_m / speed_mps;
        let motion = &config.motion;
        let grown = |of: super::super::super::Variance| of.per_s * duration_s + of.per_m * way_m;
        let [forward, sideways, turning] =
            [motion.forward, motion.sideways, motion.turning].map(grown);
        let bend = turning * way_m * way_m / 3.0;
        [forward, sideways + bend, turning].map(f64::sqrt)
    }

    #[test]
    fn a_hundred_metres_are_as_white_noise_integrates() {
        for (motion, speed_mps) in [
            ("", 1.0),
            ("", 0.5),
            ("reference_period_s = 0.1", 1.0),
            ("preset = \"car\"", 1.0),
            ("forward = { per_m = 0.04 }", 1.0),
        ] {
            let config = config(motion);
            let Doubt {
                along_m,
                across_m,
                heading_rad,
            } = straight(&config, speed_mps);
            let said = [along_m, across_m, heading_rad];
            for (said, expected) in said.into_iter().zip(integrated(&config, speed_mps)) {
                // The heading's error shortens the way, which the integrals leave out.
                let slack = 0.005 * expected + 0.5 * heading_rad * across_m;
                assert!(
                    (said - expected).abs() < slack,
                    "{motion}: {said} {expected}"
                );
            }
        }
    }

    #[test]
    fn an_hour_of_standing_is_a_third_of_the_creep_or_the_noise_at_rest() {
        let degrees = |motion: &str| standing(&config(motion)).heading_rad.to_degrees();
        let near = |said: f64, expected: f64| (said / expected - 1.0).abs() < 1e-6;
        let doubt = standing(&config(""));
        assert!(
            near(doubt.along_m, 0.1 / 3.0) && near(doubt.heading_rad, 0.05 / 3.0),
            "{doubt:?}"
        );
        assert!(degrees("") <= 1.0);
        assert!(near(
            degrees("stands_by = \"nothing\""),
            (4.6e-5_f64 * 3600.0).sqrt().to_degrees()
        ));
        let mut speeds = config("");
        for wheel in speeds
            .odometry
            .iter_mut()
            .flat_map(|it| it.wheels.iter_mut())
        {
            wheel.left.quantity = Quantity::MetresPerSecond;
        }
        assert!(standing(&speeds).heading_rad.to_degrees() > 20.0);
        speeds.motion.stands_by = StandsBy::Speeds;
        assert!(near(standing(&speeds).heading_rad, 0.05 / 3.0));
        assert!(degrees("preset = \"paper\"") > 60.0);
    }
}
