//! One process per robot, and one robot per number; and one per driver of a robot.
use std::fs::File;
use std::io::{Read, Seek, Write};
use std::path::Path;

use rustix::fs::FlockOperation;
use rustix::io::Errno;

use super::error::OpenError;
use super::{Space, lock, segments};
use crate::RobotName;
use crate::private::{NotPrivate, OwnFile};

/// Below the root: a file for each robot and one for each number, locked by the process that acts for it.
pub(super) const DIRECTORY: &str = "claims";

/// In `/dev/shm`, behind the space's name: the same for those who find no claims, because these or the whole root were
/// deleted or exchanged while the process lives.
const BEACON: &str = ".claim_";

/// Longest content of a claim (bytes).
const LIMIT: u64 = 256;

/// The right to act for a robot, or as one of its drivers. The files stay until the space is emptied: removing one would race with the next claim.
#[derive(Debug)]
pub struct Claim {
    files: Vec<File>,
    // Held so that nobody empties the space while a file is locked.
    _space: Space,
}

/// Who acts for a robot, as it stands in the files: a word each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Claimant {
    robot: String,
    id: u16,
    pid: u32,
    /// Where equal paths are equal places.
    mounts: String,
}

impl Claim {
    pub(super) fn take(space: &Space, robot: &RobotName, id: u16) -> Result<Self, OpenError> {
        let own = Claimant::new(robot, id);
        // Two who look for each other's beacons at once would see each other, and neither would run.
        let _pass = space.gate().pass();
        let claims = space.directory().subdirectory(DIRECTORY)?;
        // No robot's name has a dot.
        let names = [own.robot.clone(), format!("id.{id}")];
        let mut claim = Self {
            files: Vec::new(),
            _space: space.clone(),
        };
        for name in &names {
            let file = claims.file(name)?;
            claim.files.push(own.lock(&file)?);
        }
        own.look_around(space)?;
        claim.files.extend(own.light_beacon(space));
        Ok(claim)
    }

    pub(super) fn take_driver(
        space: &Space,
        robot: &RobotName,
        driver: &str,
        source: u16,
    ) -> Result<Self, OpenError> {
        let own = Claimant::new(robot, source);
        let _pass = space.gate().pass();
        let claims = space.directory().subdirectory(DIRECTORY)?;
        // Neither a robot's name nor a number's file has two dots.
        let file = claims.file(&format!("{robot}.{driver}.{source}"))?;
        let locked = own.try_lock(&file)?;
        let files = vec![locked.map_err(|other| OpenError::DriverRuns {
            driver: driver.into(),
            robot: robot.as_str().into(),
            sensor: source,
            pid: other.map(|other| other.pid),
        })?];
        Ok(Self {
            files,
            _space: space.clone(),
        })
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // Only the locks count; what stays behind would at worst be printed.
        for file in &self.files {
            let _ = file.set_len(0);
        }
    }
}

impl Claimant {
    fn new(robot: &RobotName, id: u16) -> Self {
        let mounts = std::fs::read_link("/proc/self/ns/mnt").unwrap_or_default();
        Self {
            robot: robot.as_str().into(),
            id,
            pid: std::process::id(),
            mounts: mounts.display().to_string(),
        }
    }

    fn lock(&self, file: &OwnFile) -> Result<File, OpenError> {
        let locked = self.try_lock(file)?;
        locked.map_err(|other| self.refusal(other.as_ref()))
    }

    /// The file, or who has it.
    fn try_lock(&self, file: &OwnFile) -> Result<Result<File, Option<Self>>, OpenError> {
        let mut opened = file.read_write()?;
        match rustix::fs::flock(&opened, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => self.write(&mut opened).map_err(failed(file.path()))?,
            Err(Errno::WOULDBLOCK) => return Ok(Err(Self::read(&opened))),
            Err(error) => return Err(failed(file.path())(error.into())),
        }
        Ok(Ok(opened))
    }

    fn write(&self, file: &mut File) -> std::io::Result<()> {
        let Self {
            robot,
            id,
            pid,
            mounts,
        } = self;
        file.set_len(0)?;
        file.rewind()?;
        write!(file, "{robot} {id} {pid} {mounts}")
    }

    pub(super) fn number_and_process(&self) -> (u16, u32) {
        (self.id, self.pid)
    }

    pub(super) fn read(file: &File) -> Option<Self> {
        let mut text = String::new();
        file.take(LIMIT).read_to_string(&mut text).ok()?;
        let mut words = text.split(' ');
        Some(Self {
            robot: words.next()?.into(),
            id: words.next()?.parse().ok()?,
            pid: words.next()?.parse().ok()?,
            mounts: words.next()?.into(),
        })
    }

    fn refusal(&self, other: Option<&Self>) -> OpenError {
        let (robot, pid) = (self.robot.clone(), other.map(|other| other.pid));
        match other {
            Some(other) if other.robot != robot => OpenError::SameNumber {
                robot,
                id: self.id,
                other: other.robot.clone(),
                pid,
            },
            _ => OpenError::AlreadyClaimed { robot, pid },
        }
    }

    /// Refuses if somebody acts for the robot or with its number in this space, or in another one whose root was the same
    /// path until it was exchanged.
    fn look_around(&self, space: &Space) -> Result<(), OpenError> {
        let place = space.place();
        let names = segments::list().map_err(failed(Path::new(segments::SHARED_MEMORY)))?;
        let beacons = names
            .iter()
            .filter(|name| name.starts_with(place.family()) && name.contains(BEACON));
        for name in beacons {
            let Some(other) = Self::who_has_lit(name) else {
                continue;
            };
            let is_here = segments::space_of(name) == Some(space_name(space));
            let same = other.robot == self.robot || other.id == self.id;
            if same && (is_here || other.mounts == self.mounts) {
                return Err(self.refusal(Some(&other)));
            }
        }
        Ok(())
    }

    /// `None` if whoever has lit it is dead.
    fn who_has_lit(beacon: &str) -> Option<Self> {
        let file = OwnFile::named(&segments::path(beacon)).ok()?;
        let file = file.existing().ok()??;
        (!lock::try_alone(&file)).then(|| Self::read(&file))?
    }

    /// If it cannot be made, an exchanged root directory is still noticed, a moment later.
    fn light_beacon(&self, space: &Space) -> Option<File> {
        let name = format!("{}{BEACON}{}", space_name(space), self.robot);
        let file: Result<OwnFile, NotPrivate> = OwnFile::named(&segments::path(&name));
        self.lock(&file.ok()?).ok()
    }
}

fn space_name(space: &Space) -> &str {
    space.place().prefix().trim_end_matches('_')
}

fn failed(path: &Path) -> impl Fn(std::io::Error) -> OpenError {
    |source| OpenError::System {
        action: "claim the robot with",
        path: path.into(),
        source,
    }
}
