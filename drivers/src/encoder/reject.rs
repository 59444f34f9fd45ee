//! Why a frame was refused, and how often.

use super::channel::Continuity;
use super::counter::Cause;

/// Why a frame of a wanted message did not count.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash, thiserror::Error)]
pub enum FrameReject {
    /// A request, not data.
    #[error("remote frame on an encoder's identifier")]
    Remote,
    /// The payload ends before the signal does.
    #[error("payload too short")]
    Short,
    /// The checksum is not that of the payload.
    #[error("wrong checksum")]
    Checksum,
    /// The alive counter did not move: the same frame again, or a sender that hangs.
    #[error("alive counter repeated")]
    Repeated,
    /// The alive counter went back: an older frame arrived after a newer one.
    #[error("alive counter went back")]
    OutOfOrder,
    /// The stamp lies before that of the frame before.
    #[error("stamp went back")]
    Backward,
    /// Faster than the robot can be, or not a number.
    #[error("implausible value")]
    Implausible,
    /// Outside of the signal's range in the DBC file, or beyond the counter's modulus: a code for "not available", or a
    /// range that is wrong.
    #[error("value outside of the signal's range")]
    OutOfRange,
}

impl FrameReject {
    /// Every reason, in the order of [`OdometryCounters::rejected`].
    pub const ALL: [Self; 8] = [
        Self::Remote,
        Self::Short,
        Self::Checksum,
        Self::Repeated,
        Self::OutOfOrder,
        Self::Backward,
        Self::Implausible,
        Self::OutOfRange,
    ];
}

/// What a decoder has counted since the start.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct OdometryCounters {
    /// Frames of wanted messages that counted.
    pub accepted: u64,
    /// Frames of wanted messages that did not, by reason: index with [`OdometryCounters::of`].
    pub rejected: [u64; FrameReject::ALL.len()],
    /// Samples formed.
    pub samples: u64,
    /// Frames that are missing by the alive counters.
    pub skipped: u64,
    /// Times that a tick counter was taken up again at another value: the encoder restarted, or frames were missing for
    /// so long that the counter may have wrapped unseen.
    pub resynchronised: u64,
    /// Times out of those that the counter may have wrapped unseen. If that is every frame, it is too narrow for its speed.
    pub ambiguous: u64,
    /// Times out of those that the counter seemed to wrap elsewhere than its width or modulus says.
    pub other_wraps: u64,
    /// Samples that would have been faster than the robot can be, because late frames came at once: their way is spread
    /// over the samples that follow.
    pub late_ways: u64,
    /// Times that the stamps' clock was set back.
    pub clock_steps: u64,
    /// Intervals too long to apply a speed to, left without a sample.
    pub gaps: u64,
}

impl OdometryCounters {
    /// How many frames were refused for `reason`.
    #[must_use]
    pub fn of(&self, reason: FrameReject) -> u64 {
        self.rejected[reason as usize]
    }

    pub(super) fn note(&mut self, continuity: Continuity) {
        let resynchronised = |cause| continuity == Continuity::Resynchronised(cause);
        self.gaps += u64::from(continuity == Continuity::Gap);
        self.resynchronised += u64::from(matches!(continuity, Continuity::Resynchronised(_)));
        self.ambiguous += u64::from(resynchronised(Cause::Ambiguous));
        self.other_wraps += u64::from(resynchronised(Cause::OtherWrap));
    }

    pub(super) fn note_reject(&mut self, reason: FrameReject) {
        self.rejected[reason as usize] += 1;
    }
}
