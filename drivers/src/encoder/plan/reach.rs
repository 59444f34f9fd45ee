//! Whether a tick counter can tell what the robot does at its fastest.

use crate::config_error::ConfigError;

use super::super::config::OdometryConfig;
use super::super::count::Counts;
use super::super::counter::Counter;
use super::super::words::{Length, Time};
use super::period::Period;

/// A counter of a wheel.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    pub(super) setting: String,
    pub(super) counts: Counts,
    pub(super) metres_per_count: f64,
    pub(super) period: Period,
}

impl Reach {
    /// From this speed on forwards and backwards look alike \[m/s\].
    fn limit_mps(&self, late_s: f64) -> f64 {
        Counter::limit_mps(self.counts, self.metres_per_count, self.period.s + late_s)
    }

    /// Below this speed no step of the counter is believed \[m/s\].
    fn least_mps(&self, late_s: f64) -> f64 {
        Counter::least_mps(self.metres_per_count, self.period.s + late_s)
    }
}

/// Refuses a highest speed that one of the counters cannot tell.
pub(super) fn check(config: &OdometryConfig, counters: &[Reach]) -> Result<(), ConfigError> {
    let (fastest, late_s) = (config.max_speed_mps, config.tolerance.late_stamp_s);
    let narrowest = counters
        .iter()
        .min_by(|a, b| a.limit_mps(late_s).total_cmp(&b.limit_mps(late_s)));
    if let Some(narrowest) = narrowest.filter(|it| fastest >= it.limit_mps(late_s)) {
        return Err(too_fast(fastest, narrowest, late_s));
    }
    let mut coarse = counters.iter().filter(|it| fastest < it.least_mps(late_s));
    coarse
        .next()
        .map_or(Ok(()), |coarse| Err(too_coarse(fastest, coarse, late_s)))
}

/// Refuses a speed that says nothing about the time between two of its frames: it would never make a sample.
pub(super) fn check_rate(setting: &str, period: Period, longest_s: f64) -> Result<(), ConfigError> {
    if period.s <= longest_s || !period.is_said() {
        return Ok(());
    }
    let problem = format!(
        "is {}, and {setting} comes {}: no two of its frames would make odometry; more than {} are needed",
        Time(longest_s),
        period.describe(),
        Time(period.s)
    );
    Err(ConfigError::setting("tolerance.longest_rate_s", problem))
}

fn too_fast(max_speed_mps: f64, it: &Reach, late_s: f64) -> ConfigError {
    let problem = format!(
        "is {max_speed_mps}; {} has {} counts of {}, too few to tell forwards from backwards between frames {} apart and up to \
         {} late: the largest speed that works is {}",
        it.setting,
        it.counts.number(),
        Length(it.metres_per_count.abs()),
        Time(it.period.s),
        Time(late_s),
        floor(it.limit_mps(late_s)),
    );
    ConfigError::setting("max_speed_mps", problem)
}

fn too_coarse(max_speed_mps: f64, it: &Reach, late_s: f64) -> ConfigError {
    let problem = format!(
        "is {max_speed_mps}; one count of {} is {}, farther than such a robot comes between frames {} apart and up to {} late: \
         no step of the counter would be believed",
        it.setting,
        Length(it.metres_per_count.abs()),
        Time(it.period.s),
        Time(late_s),
    );
    ConfigError::setting("max_speed_mps", problem)
}

/// The largest number of four digits below `limit`.
fn floor(limit: f64) -> f64 {
    let digit = 10_f64.powf(limit.log10().floor() - 3.0);
    let floor = (limit / digit).ceil() - 1.0;
    // Not `floor * digit`, which would show the rounding of a power of ten.
    format!("{:.3e}", floor * digit).parse().unwrap_or(limit)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_speed_that_is_quoted_works_and_hardly_more_does(limit in 1e-9..1e9) {
            let quoted = floor(limit);
            prop_assert!(quoted < limit && quoted > limit * 0.998, "{quoted} of {limit}");
            prop_assert!(quoted.to_string().trim_matches(['0', '.']).len() <= 12, "{quoted}");
        }
    }

    #[test]
    fn a_limit_that_is_a_number_of_four_digits_is_not_below_itself() {
        assert!((floor(2.0) - 1.999).abs() < 1e-12);
        assert!((floor(1.828_571) - 1.828).abs() < 1e-12);
    }
}
