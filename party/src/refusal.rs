//! Why a message is not used.

use coloc_sensors::Refuses;
use coloc_shm_types::Reject;

/// The reasons; their numbers are places in `refused` of the driver's status.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Refusal {
    /// The message is none that can be computed with.
    Invalid = 0,
    /// Its stamp cannot be compared with this computer's clocks.
    Clock = 1,
    /// It is too old, or from the future.
    Late = 2,
    /// It was here before, or too many speak.
    Repeated = 3,
    /// It names robots that are not of the team, or comes from another one than it says.
    Foreign = 4,
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
        Self::Foreign,
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
            Self::Foreign => "foreign",
            Self::Channel => "channel",
        }
    }
}

impl Refuses for Refusal {
    const INVALID: Self = Self::Invalid;
    const CLOCK: Self = Self::Clock;
    const LATE: Self = Self::Late;
    const REPEATED: Self = Self::Repeated;

    fn of(reason: Reject) -> Self {
        match reason {
            Reject::UnknownRobot => Self::Foreign,
            Reject::ForeignClock | Reject::UnknownClock => Self::Clock,
            Reject::TooOld | Reject::FromFuture => Self::Late,
            _ => Self::Invalid,
        }
    }

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
        }
    }
}
