//! How one source is doing.
use iceoryx2::prelude::ZeroCopySend;

use crate::layout::layout;
use crate::{Health, Input};

/// A row of [`Status`](super::Status): what came from one sensor or one robot, and what became of it.
#[derive(Copy, Clone, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.SourceHealth.v2")]
pub struct SourceHealth {
    /// [`Input`] that it is a source of; [`Self::UNUSED`]: the row is empty.
    pub input: u8,
    /// [`Health`] of this source alone.
    pub health: u8,
    /// Bit 0: contested, several senders claim it. Bit 1: unreachable, a robot that cannot be told where it is seen, because
    /// its channel has no place for another publisher. Bit 2: against, it stands against what the robot believes, and is heard but
    /// not fused. The others are zero.
    pub flags: u8,
    /// Sessions of it that live; of a source that is not contested there is one, or two for a while after a restart, or none once it is silent.
    pub live_sessions: u8,
    /// Its number: which sensor, or which robot.
    pub source: u16,
    /// Zero.
    pub reserved: [u8; 2],
    /// Its inputs that changed the belief, or were told on.
    pub accepted: u64,
    /// Its inputs that did not.
    pub rejected: u64,
    /// Its messages that never came, by the gaps in their count. It becomes less when they come late.
    pub lost: u64,
    /// Stamp of its newest valid input (ns of `CLOCK_BOOTTIME`); 0 if there was none.
    pub newest_boot_ns: i64,
    /// Since when it was refused without exception (ns of `CLOCK_BOOTTIME`); 0 if its newest passed.
    pub refused_since_boot_ns: i64,
    /// Normalised innovation squared of its newest input that met the gate.
    pub d2: f64,
    /// The gate that it met: beyond it is refused; 0 if none did.
    pub gate: f64,
}

layout!(SourceHealth, 64;
    input: 0, health: 1, flags: 2, live_sessions: 3, source: 4, reserved: 6, accepted: 8, rejected: 16, lost: 24,
    newest_boot_ns: 32, refused_since_boot_ns: 40, d2: 48, gate: 56,
);

impl SourceHealth {
    /// `input` of an empty row.
    pub const UNUSED: u8 = u8::MAX;

    /// Bits of `flags`.
    pub const CONTESTED: u8 = 1;
    /// Bits of `flags`.
    pub const UNREACHABLE: u8 = 2;
    /// Bits of `flags`.
    pub const AGAINST: u8 = 4;

    /// Of what it is a source; `None` if the row is empty.
    #[must_use]
    pub fn input(&self) -> Option<Input> {
        let mut inputs = Input::ALL.into_iter();
        inputs.find(|input| *input as u8 == self.input)
    }

    /// How it is doing.
    #[must_use]
    pub const fn health(&self) -> Health {
        Health::from_byte(self.health)
    }

    /// Whether several senders claim it.
    #[must_use]
    pub const fn is_contested(&self) -> bool {
        self.flags & Self::CONTESTED != 0
    }

    /// Whether it is a robot that cannot be told where it is seen.
    #[must_use]
    pub const fn is_unreachable(&self) -> bool {
        self.flags & Self::UNREACHABLE != 0
    }

    /// Whether it stands against what the robot believes.
    #[must_use]
    pub const fn is_against(&self) -> bool {
        self.flags & Self::AGAINST != 0
    }
}

impl Default for SourceHealth {
    /// An empty row.
    fn default() -> Self {
        Self {
            input: Self::UNUSED,
            health: 0,
            flags: 0,
            live_sessions: 0,
            source: 0,
            reserved: [0; 2],
            accepted: 0,
            rejected: 0,
            lost: 0,
            newest_boot_ns: 0,
            refused_since_boot_ns: 0,
            d2: 0.0,
            gate: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_says_of_what_it_is_a_source() {
        assert_eq!(SourceHealth::default().input(), None);
        for input in Input::ALL {
            let row = SourceHealth {
                input: input as u8,
                ..SourceHealth::default()
            };
            assert_eq!(row.input(), Some(input));
        }
    }

    #[test]
    fn each_flag_is_read_by_itself() {
        for (flags, contested, unreachable) in [
            (0, false, false),
            (SourceHealth::CONTESTED, true, false),
            (SourceHealth::UNREACHABLE, false, true),
            (3, true, true),
        ] {
            let row = SourceHealth {
                flags,
                ..SourceHealth::default()
            };
            let read = (row.is_contested(), row.is_unreachable());
            assert_eq!(read, (contested, unreachable), "{flags}");
        }
    }
}
