//! How long a source is waited for.

use coloc_estimator::Span;
use coloc_shm_types::Input;

use crate::config::{self, Config};

/// A source is stale after so many tenths of its own interval.
const TENTHS: i64 = 25;

/// Of a kind of input.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Patience {
    /// At least.
    pub(super) least: Span,
    /// Longer for one with long intervals. Not for wheels: between their samples the robot goes on by itself, and how long that
    /// may take has nothing to do with how often they speak.
    pub(super) adapts: bool,
}

impl Patience {
    pub(super) fn of(input: Input, config: &Config) -> Self {
        let rounds = &config.rounds;
        let config = &config.health;
        let least_s = match input {
            Input::Odometry | Input::Gyro => config.odometry_stale_s,
            Input::RelativePose | Input::Sighting => config.relative_pose_stale_s,
            Input::Position | Input::Pose | Input::Heading => config.position_stale_s,
            Input::Neighbour
            | Input::Seen
            | Input::Answer
            | Input::Assist
            | Input::AssistAck
            | Input::Readings
            | Input::Integrity => config.neighbours_stale_s,
            Input::Correction => rounds.timeout_s,
        };
        Self {
            least: Span::from_nanos(config::nanos(least_s)),
            adapts: input != Input::Odometry,
        }
    }

    /// With a source that speaks every `interval_ns`.
    pub(super) fn with(self, interval_ns: i64) -> Span {
        if self.adapts {
            let own = Span::from_nanos(interval_ns * TENTHS / 10);
            self.least.max(own)
        } else {
            self.least
        }
    }
}
