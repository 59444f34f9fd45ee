//! Why a scan, or a robot in it, is not published.

/// The reasons; their numbers are places in `refused` of the driver's status.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Refusal {
    /// The scan is none that can be computed with.
    BadScan = 0,
    /// Its stamp cannot be compared with this computer's clocks.
    Clock = 1,
    /// `colocd` does not say where this robot is.
    NoPose = 2,
    /// Nobody says where another robot is.
    NoTeam = 3,
    /// It may be more than one robot.
    Ambiguous = 4,
    /// It may be nobody of the team.
    Nobody = 5,
    /// There was no room for it.
    Room = 6,
    /// The channel did not take it.
    Channel = 7,
}

impl Refusal {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 8] = [
        Self::BadScan,
        Self::Clock,
        Self::NoPose,
        Self::NoTeam,
        Self::Ambiguous,
        Self::Nobody,
        Self::Room,
        Self::Channel,
    ];

    /// As it is printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::BadScan => "bad_scan",
            Self::Clock => "clock",
            Self::NoPose => "no_pose",
            Self::NoTeam => "no_team",
            Self::Ambiguous => "ambiguous",
            Self::Nobody => "nobody",
            Self::Room => "room",
            Self::Channel => "channel",
        }
    }

    /// As it stands in the log.
    #[must_use]
    pub const fn said(self) -> &'static str {
        match self {
            Self::BadScan => "refused as bad_scan: a scan cannot be used",
            Self::Clock => {
                "refused as clock: scans are stamped by a clock that cannot be compared; stamp them with CLOCK_BOOTTIME of this computer"
            }
            Self::NoPose => {
                "refused as no_pose: colocd does not say where this robot is: does it run, and has it found itself?"
            }
            Self::NoTeam => {
                "refused as no_team: no other robot says where it is: do their colocd run, and is their channel estimate carried here?"
            }
            Self::Ambiguous => "refused as ambiguous: what was seen may be more than one robot",
            Self::Nobody => "refused as nobody: what was seen may be none of the team",
            Self::Room => "refused as room: a scan has more in it than there is room for",
            Self::Channel => "refused as channel: the channel did not take a message",
        }
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
