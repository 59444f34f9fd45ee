//! What every payload begins with.
use iceoryx2::prelude::ZeroCopySend;

use crate::layout::layout;
use crate::{Clock, Reject};

/// Which moment, by which clock; who says it, and which of its messages it is.
///
/// Made by a [`Sender`](crate::Sender), so that nobody has to fill it by hand.
///
/// | offset | field | |
/// | --- | --- | --- |
/// | 0 | `stamp_ns` | i64 |
/// | 8 | `session` | u64 |
/// | 16 | `sequence` | u64 |
/// | 24 | `boot` | u64 |
/// | 32 | `source` | u16 |
/// | 34 | `clock` | u8 |
/// | 35 | `reserved` | [u8; 5] |
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Header.v2")]
pub struct Header {
    /// When it was measured (ns of `clock`).
    pub stamp_ns: i64,
    /// Random, drawn when the sender starts: after a restart it counts from 0 again under another number.
    pub session: u64,
    /// Counts the sender's messages on this channel within the session.
    pub sequence: u64,
    /// Which start of which computer: the first eight bytes of `/proc/sys/kernel/random/boot_id`, 0 if unknown. Stamps of
    /// [`Clock::Boottime`] mean something only within one.
    pub boot: u64,
    /// Which sensor of this kind (0 where there is one), or the team number of the robot that speaks.
    pub source: u16,
    /// [`Clock`] of `stamp_ns`; read it with [`Self::clock`].
    pub clock: u8,
    /// Zero.
    pub reserved: [u8; 5],
}

layout!(Header, 40; stamp_ns: 0, session: 8, sequence: 16, boot: 24, source: 32, clock: 34, reserved: 35);

impl Header {
    /// Of which clock the stamp is.
    ///
    /// # Errors
    /// [`Reject::UnknownClock`].
    pub const fn clock(&self) -> Result<Clock, Reject> {
        Clock::from_byte(self.clock)
    }
}
