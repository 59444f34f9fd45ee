//! How far a kind of message goes.
use coloc_shm_types::{Audience, Matters, Speaker};

use crate::kinds::Kind;

/// For whom a kind of message is, among the members of a team on other computers.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Reach {
    /// It stays on the robot.
    Here,
    /// For the robot on whose channel it is said.
    Addressee,
    /// For all robots: it is said on the speaker's own channel.
    Team,
    /// For stations, which listen: the newest is enough, now and then.
    Stations,
}

impl Reach {
    /// That of a kind, by its row in the table of channels alone.
    #[must_use]
    pub const fn of(kind: &Kind) -> Self {
        let told = &kind.told;
        match told.by {
            Speaker::Neighbours | Speaker::Trackers => Self::Addressee,
            Speaker::Bounds if matches!(told.matters, Matters::All) => Self::Team,
            // What is for the own daemon alone is no word of a round.
            Speaker::Rounds if matches!(told.to, Audience::Anyone) => Self::Team,
            Speaker::Own | Speaker::Bounds if told.late_joiner => Self::Stations,
            _ => Self::Here,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_row_says_is_how_far_it_goes() {
        let reach = |name| Kind::of_name(name).map(|kind| Reach::of(&kind));
        for name in [
            "neighbour",
            "seen",
            "answer",
            "assist",
            "assist_ack",
            "increment",
        ] {
            assert_eq!(reach(name), Some(Reach::Addressee), "{name}");
        }
        for name in ["evidence", "share", "round", "call"] {
            assert_eq!(reach(name), Some(Reach::Team), "{name}");
        }
        for name in ["estimate", "status", "integrity"] {
            assert_eq!(reach(name), Some(Reach::Stations), "{name}");
        }
        for name in [
            "odometry",
            "relative_pose",
            "scan",
            "driver",
            "timing",
            "tracked",
            "correction",
            "shared",
        ] {
            assert_eq!(reach(name), Some(Reach::Here), "{name}");
        }
    }
}
