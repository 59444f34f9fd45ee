//! How fast neighbours' poses come, and how much of itself the belief may give up for each.
//!
//! Split covariance intersection pays for every pose it fuses: the own dependent part grows by `1/α`. What the belief
//! learned from motion, the heading above all, is forgotten at a rate of messages times `1 − α`, not of time. At 10 Hz from four
//! neighbours even β = 0.2 leaves a memory of a quarter of a second, so that a team with one satellite receiver loses its
//! common heading; at 2 Hz the same β is right. So what is set is the memory τ, and β follows from the pace:
//!
//! ```text
//! T̄ ← T̄ + (T − T̄)/8      T: time since the pose received before, by their stamps
//! β = min(β_max, T̄/τ)
//! ```
//!
//! A function of stamps alone: the bound of split covariance intersection holds.

use crate::settings::FusionSettings;
use crate::stamp::{Span, Stamp};

/// Part of the latest interval in the smoothed one: two events of four poses.
const SMOOTHING: f64 = 0.125;

/// The interval before anything was heard \[s\]: news is welcome.
const INITIAL_INTERVAL_S: f64 = 1.0;

/// The smoothed interval between the neighbours' poses received, and whether there was any before.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Pace {
    last: Stamp,
    interval_s: f64,
    met: Met,
}

/// Whom a robot has met.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
enum Met {
    #[default]
    Nobody,
    /// One pose was heard, and that is the one to be fused.
    First,
    Somebody,
}

impl Pace {
    /// Nothing was heard up to `stamp`.
    #[must_use]
    pub fn beginning(stamp: Stamp) -> Self {
        Self {
            last: stamp,
            interval_s: INITIAL_INTERVAL_S,
            met: Met::Nobody,
        }
    }

    /// Something of the belief may be known to others or by them, whatever was heard.
    #[must_use]
    #[inline]
    pub fn met(self) -> Self {
        Self {
            met: Met::Somebody,
            ..self
        }
    }

    /// After one more pose, stamped `stamp`; fused or not.
    #[must_use]
    pub fn heard(self, stamp: Stamp) -> Self {
        let latest_s = (stamp - self.last).as_seconds().max(0.0);
        Self {
            last: stamp,
            interval_s: self.interval_s + SMOOTHING * (latest_s - self.interval_s),
            met: match self.met {
                Met::Nobody => Met::First,
                Met::First | Met::Somebody => Met::Somebody,
            },
        }
    }

    /// `settings` with β as this pace allows, for [`crate::fuse`]; as they are if their memory is zero.
    ///
    /// β is 1 for the first pose of a robot that has met nobody. What is damped is forgetting what others helped to learn; of such a
    /// robot curvature alone is dependent ([`crate::honest`]), on itself, and it gives up nothing by hearing.
    #[must_use]
    pub fn damped(&self, settings: &FusionSettings) -> FusionSettings {
        if self.met != Met::Somebody {
            return FusionSettings {
                damping: 1.0,
                ..*settings
            };
        }
        if settings.memory <= Span::ZERO {
            return *settings;
        }
        let allowed = self.interval_s / settings.memory.as_seconds();
        FusionSettings {
            damping: settings.damping.min(allowed),
            ..*settings
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(memory_ms: i64) -> FusionSettings {
        FusionSettings {
            damping: 0.2,
            memory: Span::from_millis(memory_ms),
            ..FusionSettings::paper()
        }
    }

    /// β after a minute of events every `period_ms`, each of `poses` poses: the last of its event.
    fn damping_at(period_ms: i64, poses: usize, memory_ms: i64) -> f64 {
        let mut pace = Pace::beginning(Stamp::default());
        for event in 1..=60_000 / period_ms {
            let stamp = Stamp::default() + Span::from_millis(event * period_ms);
            pace = (0..poses).fold(pace, |pace, _| pace.heard(stamp));
        }
        pace.damped(&settings(memory_ms)).damping
    }

    #[test]
    fn a_regular_pace_gives_interval_over_memory() {
        assert!((damping_at(100, 1, 1000) - 0.1).abs() < 1e-9);
        assert!((damping_at(100, 1, 2000) - 0.05).abs() < 1e-9);
    }

    #[test]
    fn poses_that_come_together_share_what_their_interval_allows() {
        let [together, apart] = [damping_at(100, 4, 1000), damping_at(25, 1, 1000)];
        assert!(
            (0.6 * apart..apart).contains(&together),
            "{together} {apart}"
        );
    }

    #[test]
    fn the_fixed_damping_is_the_most_and_all_there_is_without_a_memory() {
        assert_eq!(damping_at(500, 1, 1000), 0.2);
        assert_eq!(damping_at(25, 1, 0), 0.2);
        let beginning = Pace::beginning(Stamp::default()).met();
        assert_eq!(beginning.damped(&settings(1000)).damping, 0.2);
    }

    #[test]
    fn the_first_pose_that_a_robot_hears_is_not_damped() {
        let beginning = Pace::beginning(Stamp::default());
        let soon = Stamp::default() + Span::from_millis(10);
        let damping = |pace: Pace| pace.damped(&settings(1000)).damping;
        assert_eq!(damping(beginning.heard(soon)), 1.0);
        assert_eq!(damping(beginning.heard(soon).heard(soon)), 0.2);
        assert_eq!(damping(beginning.met().heard(soon)), 0.2);
    }
}
