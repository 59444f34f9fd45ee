//! What came of the frames of the wheel encoders.
use iceoryx2::prelude::ZeroCopySend;

use crate::layout::layout;

/// What buses and decoder of the wheel encoders have counted, all buses together.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.CanCounters.v2")]
pub struct CanCounters {
    /// Encoder frames that were received, good or bad.
    pub frames: u64,
    /// Samples of odometry that were made of them.
    pub samples: u64,
    /// Error frames of any class.
    pub error_frames: u64,
    /// Encoder frames whose checksum was wrong.
    pub checksum_errors: u64,
    /// Frames that were too short, remote or no frames at all.
    pub malformed: u64,
    /// Encoder frames with a value outside of its range.
    pub out_of_range: u64,
    /// Encoder frames that say that the robot is faster than it can be.
    pub implausible: u64,
    /// Frames that are missing by the alive counter.
    pub alive_skips: u64,
    /// Frames that came again by the alive counter.
    pub alive_repeats: u64,
    /// Encoder frames stamped before the one before them, or that count backward by the alive counter.
    pub out_of_order: u64,
    /// Frames the kernel dropped because the receive buffer was full.
    pub rx_overflows: u64,
    /// Times the bus was opened again.
    pub reopens: u64,
    /// Times that a tick counter was taken up again at another value: the encoder restarted, or frames were missing for so
    /// long that it may have wrapped unseen.
    pub resynchronised: u64,
    /// Times out of those that it may have wrapped unseen.
    pub ambiguous: u64,
    /// Times out of those that it seemed to wrap elsewhere than its width or modulus says.
    pub other_wraps: u64,
    /// Samples that would have been faster than the robot can be, because late frames came at once; their way is spread over
    /// those that followed.
    pub late_ways: u64,
    /// Intervals too long to apply a speed to, left without a sample.
    pub gaps: u64,
    /// Times that wheels began not to fit one another.
    pub slips: u64,
    /// 1 while they do not, else 0; which of them it is the log says.
    pub slipping: u64,
    /// Times that a CANopen node said that it has booted.
    pub boot_ups: u64,
    /// CANopen nodes whose heartbeat is missing now; which of them the log says.
    pub nodes_missing: u64,
    /// Zero, for counters to come.
    pub spare: [u64; 3],
}

layout!(CanCounters, 192;
    frames: 0, samples: 8, error_frames: 16, checksum_errors: 24, malformed: 32, out_of_range: 40, implausible: 48,
    alive_skips: 56, alive_repeats: 64, out_of_order: 72, rx_overflows: 80, reopens: 88, resynchronised: 96, ambiguous: 104,
    other_wraps: 112, late_ways: 120, gaps: 128, slips: 136, slipping: 144, boot_ups: 152,
    nodes_missing: 160, spare: 168,
);
