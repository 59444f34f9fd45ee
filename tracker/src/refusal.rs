//! Why a message, or a sighting, is not used.

use coloc_sensors::Refuses;

use coloc_track::Verdict;

/// The reasons; their numbers are places in `refused` of the driver's status.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Refusal {
    /// The message is none that can be computed with.
    Invalid = 0,
    /// Its stamp cannot be compared with this computer's clocks.
    Clock = 1,
    /// It came after its moment was over.
    Late = 2,
    /// It was here before, or too many speak.
    Repeated = 3,
    /// More sensors than a track has room for.
    Sensors = 4,
    /// It does not fit its track.
    Rejected = 5,
    /// It fits two tracks, or another fits its track.
    Ambiguous = 6,
    /// It fits no track.
    Unassigned = 7,
    /// There is no track that could learn of it.
    Ignored = 8,
    /// A channel did not take a message.
    Channel = 9,
}

impl Refusal {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 10] = [
        Self::Invalid,
        Self::Clock,
        Self::Late,
        Self::Repeated,
        Self::Sensors,
        Self::Rejected,
        Self::Ambiguous,
        Self::Unassigned,
        Self::Ignored,
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
            Self::Sensors => "sensors",
            Self::Rejected => "rejected",
            Self::Ambiguous => "ambiguous",
            Self::Unassigned => "unassigned",
            Self::Ignored => "ignored",
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
                "refused as late: a message came after its moment was over; a larger track.delay_s waits for it"
            }
            Self::Repeated => "refused as repeated: a message was here before",
            Self::Sensors => "refused as sensors: more than four sensors see others in part",
            Self::Rejected => "refused as rejected: a sighting does not fit its track",
            Self::Ambiguous => "refused as ambiguous: what was seen may be more than one robot",
            Self::Unassigned => "refused as unassigned: what was seen may be nobody of the team",
            Self::Ignored => "refused as ignored: a bearing or a range alone begins no track",
            Self::Channel => "refused as channel: a channel did not take a message",
        }
    }

    /// What became of a sighting, where it taught nothing.
    #[must_use]
    pub const fn of(verdict: Verdict) -> Option<Self> {
        match verdict {
            Verdict::Started | Verdict::Restarted | Verdict::Accepted { .. } => None,
            Verdict::Rejected { .. } => Some(Self::Rejected),
            Verdict::Ignored => Some(Self::Ignored),
            Verdict::Ambiguous => Some(Self::Ambiguous),
            Verdict::Unassigned => Some(Self::Unassigned),
            Verdict::OutOfStep => Some(Self::Late),
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
