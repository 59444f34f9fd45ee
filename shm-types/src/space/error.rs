//! What can go wrong with a space, in words that tell a person what to do.
use std::path::PathBuf;

use iceoryx2::node::NodeCreationFailure;

use super::group::{NoGroup, ReadError};
use crate::advice::advised;
use crate::places::NoPlace;
use crate::private::NotPrivate;

/// A space could not be opened, or a robot not be claimed: the program cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// None was named, and this user has no default place.
    #[error(transparent)]
    NoPlace(#[from] NoPlace),
    /// A directory or file is not ours alone.
    #[error(transparent)]
    NotPrivate(#[from] NotPrivate),
    /// A group that nothing can be opened to.
    #[error(transparent)]
    NoGroup(#[from] NoGroup),
    /// Another user's robot, which this one may not read.
    #[error(transparent)]
    NotReadable(#[from] ReadError),
    /// The prefix would not fit into file names.
    #[error("shared-memory prefix `{prefix}`: use 1 to 16 of the characters a-z, A-Z, 0-9 and `_`")]
    BadPrefix {
        /// What was given.
        prefix: String,
    },
    /// The path of the root directory does not fit into iceoryx2's paths.
    #[error(
        "shared-memory root {:?}: use an absolute path of at most {limit} bytes, of ASCII characters alone", .root
    )]
    BadRoot {
        /// What was given.
        root: PathBuf,
        /// Longest path (bytes).
        limit: usize,
    },
    /// The operating system refused something.
    #[error("cannot {action} {}: {}", .path.display(), advised(.source))]
    System {
        /// What was tried, as in "cannot …".
        action: &'static str,
        /// On which path.
        path: PathBuf,
        /// What it said.
        source: std::io::Error,
    },
    /// A file system without which nothing works.
    #[error(
        "{at} is not mounted, and coloc needs it: mount it ({command}), also in a container or chroot"
    )]
    NotMounted {
        /// Where it belongs.
        at: &'static str,
        /// What mounts it.
        command: &'static str,
    },
    /// Somebody else keeps the directory or file to himself.
    #[error(
        "{} is locked by {}, for longer than anybody of coloc needs: end that, then start again",
        .path.display(), holders(.processes)
    )]
    Locked {
        /// What is locked.
        path: PathBuf,
        /// Who has it, as far as the kernel says so.
        processes: Vec<u32>,
    },
    /// Files of a space were deleted below its root while somebody is in it.
    #[error(
        "what was in {} was deleted while programs use it ({}): end them, then start again",
        .root.display(), holders(.processes)
    )]
    Emptied {
        /// The root directory.
        root: PathBuf,
        /// Who is inside, as far as the kernel says so.
        processes: Vec<u32>,
    },
    /// The root directory is used for something else, which cleaning up would destroy.
    #[error(
        "shared-memory root {} contains `{entry}`, which is not of coloc: \
         choose a directory that holds nothing else, it is emptied when the last process leaves",
        .root.display()
    )]
    NotOurs {
        /// The root directory.
        root: PathBuf,
        /// What is in it.
        entry: String,
    },
    /// Writing to shared memory that has no room ends the process (SIGBUS), so it does not come to that.
    #[error(
        "/dev/shm has {free} bytes left, coloc wants {wanted} to start with: \
         remove what is not needed there, or enlarge it (mount -o remount,size=… /dev/shm; docker run --shm-size)"
    )]
    NoRoom {
        /// Free bytes.
        free: u64,
        /// Wanted bytes.
        wanted: u64,
    },
    /// The name of the node is too long.
    #[error("`{name}` cannot name a node: it is too long")]
    BadNodeName {
        /// What was given.
        name: String,
    },
    /// iceoryx2 could not take part.
    #[error(
        "iceoryx2 cannot start in {} ({reason}): check that /dev/shm is mounted, writable and has room",
        .root.display()
    )]
    Node {
        /// The root directory.
        root: PathBuf,
        /// What it said.
        reason: NodeCreationFailure,
    },
    /// The operating system refused something while iceoryx2 started.
    #[error("iceoryx2 cannot start in {}: {source}; {advice}", .root.display())]
    Refused {
        /// The root directory.
        root: PathBuf,
        /// What it said.
        source: std::io::Error,
        /// What to do about it.
        advice: &'static str,
    },
    /// Another process acts for this robot.
    #[error("robot `{robot}` is already run by {}: stop it first, or give this robot another name", process(*.pid))]
    AlreadyClaimed {
        /// The robot's name.
        robot: String,
        /// Who came first, if it said so.
        pid: Option<u32>,
    },
    /// Another process is this driver of the robot.
    #[error(
        "the driver `{driver}` of robot `{robot}` already runs as {}, for the sensor {sensor}: \
         stop it first, or give another sensor another number",
        process(*.pid)
    )]
    DriverRuns {
        /// The driver, as in its status.
        driver: String,
        /// The robot's name.
        robot: String,
        /// The number of its sensor.
        sensor: u16,
        /// Who came first, if it said so.
        pid: Option<u32>,
    },
    /// Another robot has the number.
    #[error(
        "robot `{robot}` has the number {id}, which is already that of `{other}`, run by {}: \
         stop that, or give this robot another number",
        process(*.pid)
    )]
    SameNumber {
        /// The robot's name.
        robot: String,
        /// Its number.
        id: u16,
        /// The name of the robot that came first.
        other: String,
        /// Its process, if it said so.
        pid: Option<u32>,
    },
}

fn holders(processes: &[u32]) -> String {
    if processes.is_empty() {
        return "some process".into();
    }
    let numbers: Vec<_> = processes.iter().map(ToString::to_string).collect();
    format!("process {}", numbers.join(", "))
}

/// What was removed besides.
fn beside(files: usize) -> String {
    match files {
        0 => String::new(),
        1 => ", and a file in /dev/shm".into(),
        _ => format!(", and {files} files in /dev/shm"),
    }
}

fn process(pid: Option<u32>) -> String {
    pid.map_or_else(|| "another process".into(), |pid| format!("process {pid}"))
}

/// The place of a space was deleted or exchanged while it was used: nobody who comes now meets those who are inside.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{} was deleted or exchanged while coloc used it: programs that start from now on do not meet those that run, \
     so all of them must be started again",
    .0.display()
)]
pub struct Lost(pub PathBuf);

/// What a person should know about how a space was entered, though it works.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Remark {
    /// The directory was open to others.
    #[error("{} was open to others (mode {mode:04o}) and is closed now (0700)", .root.display())]
    Closed {
        /// The root directory.
        root: PathBuf,
        /// What its mode was.
        mode: u32,
    },
    /// Anybody could take files in `/dev/shm` away.
    #[error(
        "others may delete what is in /dev/shm (mode {mode:04o}, without the sticky bit), which ends every robot: \
         the administrator should close it (chmod 1777 /dev/shm)"
    )]
    Loose {
        /// The mode of `/dev/shm`.
        mode: u32,
    },
    /// Processes that could not clean up had left something.
    #[error("removed what processes that were killed or had lost their root had left in {}{}", .root.display(), beside(*.files))]
    Swept {
        /// The root directory.
        root: PathBuf,
        /// Files in `/dev/shm`, of all spaces in which nobody is.
        files: usize,
    },
    /// Processes that could not clean up had left something, among what is of those who live.
    #[error("removed {files} files that processes had left in {} which were killed or had lost their root", .root.display())]
    Tidied {
        /// The root directory.
        root: PathBuf,
        /// Files, in `/dev/shm` as well.
        files: usize,
    },
    /// There was something else in the place of a directory.
    #[error("{} was no directory; it was removed, and the directory is made anew", .path.display())]
    Restored {
        /// What was there.
        path: PathBuf,
    },
    /// Somebody who does not take part in the locks may be alive inside.
    #[error("what is in {} stays, because programs of iceoryx2 may be alive in it", .root.display())]
    Kept {
        /// The root directory.
        root: PathBuf,
    },
}

/// A port could not be opened: the program cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
    /// The service exists with another payload.
    #[error(
        "{service} carries `{theirs}`, and this program speaks `{ours}`: a program of {} coloc uses this shared memory, \
         so stop every program that uses it, in any language, update all of them and start them again",
        super::spoken::age(.theirs, .ours)
    )]
    OtherType {
        /// Name of the service.
        service: String,
        /// Which payload it carries.
        theirs: String,
        /// Which one this program speaks.
        ours: &'static str,
    },
    /// The service exists with other dimensions.
    #[error(
        "{service} was opened with another quality of service ({reason}): \
         update and restart every program that uses it, in any language"
    )]
    OtherQuality {
        /// Name of the service.
        service: String,
        /// Which dimension.
        reason: String,
    },
    /// It was to be found, and is not there.
    #[error("nobody has opened {service}: start the daemon of that robot")]
    NoChannel {
        /// Name of the service.
        service: String,
    },
    /// All places are taken.
    #[error(
        "{service} has no place for another {port} (limit {limit}): stop one of the programs that use it"
    )]
    Full {
        /// Name of the service.
        service: String,
        /// Publisher, subscriber or process.
        port: &'static str,
        /// How many there may be.
        limit: usize,
    },
    /// The operating system refused something.
    #[error("cannot open {service}: {source}; {advice}")]
    Refused {
        /// Name of the service.
        service: String,
        /// What it said.
        source: std::io::Error,
        /// What to do about it.
        advice: &'static str,
    },
    /// Its files were removed while this process uses it.
    #[error(transparent)]
    Lost(#[from] Lost),
    /// iceoryx2 failed otherwise.
    #[error(
        "cannot open {service} ({reason}): check that /dev/shm has room; if it persists, stop all programs of this space and start again"
    )]
    Transport {
        /// Name of the service.
        service: String,
        /// What it said.
        reason: String,
    },
}

/// A message could not be sent, or not to everybody: the next one may be.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a message was not delivered to every subscriber: {0}")]
pub struct SendError(pub(crate) iceoryx2::port::SendError);

/// Messages of some publisher could not be read: the next ones may be.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("messages of a publisher could not be read: {0}")]
pub struct ReceiveError(pub(crate) iceoryx2::port::ReceiveError);

/// It cannot be waited for messages.
#[derive(Debug, thiserror::Error)]
pub enum WaitError {
    /// There is nothing to be woken by: looking now and then goes on.
    #[error(transparent)]
    Bell(#[from] PortError),
    /// Messages of some publisher could not be read.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
}
