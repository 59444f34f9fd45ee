//! Why a message is refused before anything is decided by it.

use core::fmt;

/// The search is then as it was.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Its leader is no leader of this team.
    NotALeader,
    /// It is for nobody.
    PathTooShort,
    /// It went through more robots than a path holds.
    PathTooLong,
    /// A robot of its path is not in the team.
    UnknownRobot,
    /// A robot is in its path twice. It gets a "no" all the same: whoever sent it may use the sighting for another leader.
    Looped,
    /// A leader is in its path after the first: leaders do not relay.
    LeaderRelays,
    /// It is for another robot.
    NotForMe,
    /// Its sender is not the last but one of its path.
    NotOfSender,
    /// It says that it is final, which only a leader may say, and only where leaders know all readings.
    NotFinal,
    /// It is not final where leaders know all readings: nothing is handed on there.
    NotHandedOn,
    /// Its stamp is not in the slot that it names, or that slot is yet to come.
    WrongEvent,
    /// A number of it is none, or too large.
    NotFinite,
    /// An acknowledgement from a robot that is no child of this team.
    NotAChild,
    /// Leaders take nothing from children: what a child believes has the leader's error in it.
    NotForRole,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotALeader => "its leader is not in the list of leaders",
            Self::PathTooShort => "its path names fewer than two robots",
            Self::PathTooLong => "its path names more than 16 robots",
            Self::UnknownRobot => "a robot of its path is not in the team",
            Self::Looped => "its path names a robot twice",
            Self::LeaderRelays => "its path goes through a leader",
            Self::NotForMe => "its path ends at another robot",
            Self::NotOfSender => "its sender is not the last but one of its path",
            Self::NotFinal => "it says that it is final and cannot be",
            Self::NotHandedOn => "it is not final although leaders know all readings",
            Self::WrongEvent => "its stamp does not fit its slot, or the slot is yet to come",
            Self::NotFinite => "a number of it is not finite or too large",
            Self::NotAChild => "only children acknowledge",
            Self::NotForRole => "a leader takes nothing from children",
        })
    }
}

impl core::error::Error for Refusal {}
