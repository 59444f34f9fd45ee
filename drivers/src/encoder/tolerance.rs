//! How much disorder is usual: the numbers that can be set by which the decoder decides what to believe.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How much disorder of frames and counts is believed to be an accident. What is written here fits encoders that send ten to
/// a thousand times a second.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tolerance {
    /// One frame may be stamped that much late and the next one in time: so much farther than `max_speed_mps` allows a
    /// counter may have come \[s\].
    #[schemars(range(min = 0, max = 1))]
    pub late_stamp_s: f64,
    /// After a jump so many counts in a row must agree with one another before the encoder is believed to have restarted: a
    /// second sender on the same identifier gets through only if ours falls silent.
    #[schemars(range(min = 2, max = 100))]
    pub restart_counts: u32,
    /// A speed says nothing about a time longer than this before it; counts say only how far each wheel came in all, and of a
    /// time longer than this, and than three lost frames leave, nobody knows the path: the pose is as uncertain as
    /// `max_speed_mps` makes it \[s\].
    #[schemars(range(max = 10), extend("exclusiveMinimum" = 0))]
    pub longest_rate_s: f64,
    /// While every wheel has news but not of one moment, so many frames are waited for.
    #[schemars(range(min = 1, max = 100))]
    pub pair_frames: u32,
    /// Where late frames came at once, so that their way is too long for its time, so long is waited for the time to grow;
    /// then a part of the way is said, and the rest goes into the next sample \[s\].
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub longest_wait_s: f64,
    /// No frame is later than this: more way than the robot could have come in it is garbage \[s\].
    #[schemars(range(max = 10), extend("exclusiveMinimum" = 0))]
    pub latest_s: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self {
            late_stamp_s: 0.05,
            restart_counts: 3,
            longest_rate_s: 0.5,
            pair_frames: 4,
            longest_wait_s: 0.1,
            latest_s: 1.0,
        }
    }
}

// What follows is no robot's own: it tells accidents from signs.

/// Shorter intervals are not worth a sample, and a division by them not its noise.
pub(super) const SHORTEST_INTERVAL_NS: i64 = 1_000_000;

/// After so many periods without a new count of an alive counter any count is news, however wide the counter: its sender has
/// restarted.
pub(super) const ALIVE_MEMORY_PERIODS: u64 = 128;

/// So many wraps in a row that are too early by the same number of counts are no accident.
pub(super) const CONVINCING_WRAPS: u32 = 8;

/// Fewer counts than this may be missing before a wrap by accident.
pub(super) const FEWEST_MISSING_COUNTS: f64 = 4.0;

/// An interval between stamps, as settings say it.
#[expect(
    clippy::cast_precision_loss,
    reason = "nanoseconds of days are within 2^53"
)]
pub(super) fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
