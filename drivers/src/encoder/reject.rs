//! Why a frame was refused, and how often.

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
}

impl FrameReject {
    /// Every reason, in the order of [`OdometryCounters::rejected`].
    pub const ALL: [Self; 7] = [
        Self::Remote,
        Self::Short,
        Self::Checksum,
        Self::Repeated,
        Self::OutOfOrder,
        Self::Backward,
        Self::Implausible,
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

    pub(super) fn note_reject(&mut self, reason: FrameReject) {
        self.rejected[reason as usize] += 1;
    }
}
