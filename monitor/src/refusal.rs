//! Why a message is not used.

use coloc_sensors::Refuses;

/// The reasons; their numbers are places in `refused` of the driver's status.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Refusal {
    /// The message is none that can be computed with.
    Invalid = 0,
    /// Its stamp cannot be compared with this computer's clocks.
    Clock = 1,
    /// It came after its slot was over.
    Late = 2,
    /// It was here before, or too many speak.
    Repeated = 3,
    /// A slot was not closed in time.
    Skipped = 4,
    /// A channel did not take a message.
    Channel = 5,
}

impl Refusal {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 6] = [
        Self::Invalid,
        Self::Clock,
        Self::Late,
        Self::Repeated,
        Self::Skipped,
        Self::Channel,
    ];

    /// As it is printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Invalid => "invalid",
            Self::Clock => "clock",
            Self::Late => "late",
            Self::Repeated => "repeated",
            Self::Skipped => "skipped",
            Self::Channel => "channel",
        }
    }

    /// As it stands in the log.
    #[must_use]
    pub const fn said(self) -> &'static str {
        match self {
            Self::Invalid => "refused as invalid: a message cannot be used",
            Self::Clock => {
                "refused as clock: a message is stamped by a clock that cannot be compared; stamp it with CLOCK_BOOTTIME of this computer, or let \
                 NTP keep CLOCK_REALTIME of all"
            }
            Self::Late => {
                "refused as late: a message came after its slot was over; a larger bounds.grace_s waits for it"
            }
            Self::Repeated => "refused as repeated: a message was here before",
            Self::Skipped => {
                "counted as skipped: a slot was not closed in time, and nothing was used that was measured in it"
            }
            Self::Channel => "refused as channel: a channel did not take a message",
        }
    }
}

impl Refuses for Refusal {
    const INVALID: Self = Self::Invalid;
    const CLOCK: Self = Self::Clock;
    const LATE: Self = Self::Late;
    const REPEATED: Self = Self::Repeated;

    fn place(self) -> usize {
        self as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_places() {
        for (place, refusal) in Refusal::ALL.into_iter().enumerate() {
            assert_eq!(refusal as usize, place);
            assert!(refusal.said().contains(refusal.name()));
        }
    }
}
