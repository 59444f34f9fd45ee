//! Why a group is not admitted, or does not get in, in words that tell a person what to do.
use std::io;
use std::path::PathBuf;

use crate::RobotName;
use crate::advice::advised;

/// A group that nothing can be opened to.
#[derive(Debug, thiserror::Error)]
pub enum NoGroup {
    /// Nobody knows it.
    #[error(
        "there is no group `{name}` on this computer: make it (groupadd {name}), or name another one"
    )]
    Unknown {
        /// What was given.
        name: String,
    },
    /// It cannot be looked up.
    #[error("the group `{name}` cannot be looked up: {}; its number will do as well", advised(.source))]
    Unreadable {
        /// What was given.
        name: String,
        /// What the system said.
        source: io::Error,
    },
    /// Only members give files to a group.
    #[error(
        "user {user}, who runs this, is not in the group {group}, so nothing can be opened to it: as the superuser add \
         that user (usermod -aG {word} USER), then start this from a new login or restart its service"
    )]
    NotAMember {
        /// Name and number.
        group: String,
        /// As commands want it.
        word: String,
        /// The user's number.
        user: u32,
    },
}

/// A robot of another user cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// Its user has opened nothing.
    #[error(
        "{} belongs to user {owner}, who lets no other user read there: run this as that user; or start colocd there \
         with `group` in [shm] of its robot.toml, a group of which user {own} is a member",
        .root.display()
    )]
    NotShared {
        /// Where robots were looked for.
        root: PathBuf,
        /// Whose that is.
        owner: u32,
        /// The user number of this process.
        own: u32,
    },
    /// Others may.
    #[error(
        "user {own} may not read {robot}, the group {group} may: as the superuser add that user to it \
         (usermod -aG {word} USER), then log in again"
    )]
    NotInGroup {
        /// Which one.
        robot: RobotName,
        /// Name and number.
        group: String,
        /// As commands want it.
        word: String,
        /// The user number of this process.
        own: u32,
    },
    /// Not this one.
    #[error("no robot {robot} that this user may read runs in {}: start its colocd, with `group` in [shm]", .root.display())]
    NotThere {
        /// Which one.
        robot: RobotName,
        /// Where it was looked for.
        root: PathBuf,
    },
    /// It is a program of another version.
    #[error(
        "{robot} says `{theirs}`, and this program reads `{ours}`: update the older one of the two"
    )]
    OtherType {
        /// Which one.
        robot: RobotName,
        /// What it says.
        theirs: String,
        /// What this program reads.
        ours: &'static str,
    },
    /// It has ended.
    #[error("{robot} does not run any more")]
    Gone {
        /// Which one.
        robot: RobotName,
    },
    /// The operating system refused something.
    #[error("cannot {action} {robot}: {}", advised(.source))]
    System {
        /// What was tried, as in "cannot …".
        action: &'static str,
        /// Which one.
        robot: RobotName,
        /// What it said.
        source: io::Error,
    },
}
