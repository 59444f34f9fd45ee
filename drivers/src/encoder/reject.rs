//! Why a frame, or a reading of a base, was refused.

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
    /// Every reason, in the order of [`super::OdometryCounters::rejected`].
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
