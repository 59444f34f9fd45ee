//! What comes from a bus.

use super::frame::Frame;

/// A frame, when and from where it came.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Received {
    /// What came.
    pub frame: Frame,
    /// When it was received \[ns of the bus's [`StampClock`]\].
    pub stamp_ns: i64,
    /// The number that [`super::Bus::open`] gave to the bus.
    pub bus: u8,
}

/// The clock of a bus's stamps.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum StampClock {
    /// `CLOCK_REALTIME`, with which the kernel stamps what comes through a socket. Somebody may set it meanwhile.
    Realtime,
    /// `CLOCK_BOOTTIME`, by which recorded logs are played.
    Boottime,
}

/// What one call of [`super::Bus::receive`] did.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Drained {
    /// Frames handed on.
    pub frames: usize,
    /// The call ended at its limit of [`FRAMES_PER_CALL`]: more may be waiting.
    pub more: bool,
}

/// The most that one call of [`super::Bus::receive`] takes off a bus: a flooded bus must not hold the tick hostage.
pub const FRAMES_PER_CALL: usize = 256;
