//! One process per robot.
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::PathBuf;

use rustix::fs::FlockOperation;
use rustix::io::Errno;

use super::Space;
use super::error::OpenError;
use crate::RobotName;

/// Below the root: a file for each robot, locked by the process that acts for it, containing that process's number.
pub(super) const DIRECTORY: &str = "claims";

/// The right to act for a robot. The file stays until the space is emptied: removing it would race with the next claim.
#[derive(Debug)]
pub struct Claim {
    file: File,
    // Held so that nobody empties the space while the file is locked.
    _space: Space,
}

impl Claim {
    pub(super) fn take(space: &Space, robot: &RobotName) -> Result<Self, OpenError> {
        let path = space.root().join(DIRECTORY).join(robot.as_str());
        let failed = |source| OpenError::System {
            action: "claim the robot with",
            path: path.clone(),
            source,
        };
        let mut file = open(&path).map_err(failed)?;
        match rustix::fs::flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => sign(&mut file).map_err(failed)?,
            Err(Errno::WOULDBLOCK) => return Err(refusal(robot, &file)),
            Err(error) => return Err(failed(error.into())),
        }
        Ok(Self {
            file,
            _space: space.clone(),
        })
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // Only the lock counts; a number that stays behind would at worst be printed.
        let _ = self.file.set_len(0);
    }
}

fn open(path: &PathBuf) -> io::Result<File> {
    if let Some(directory) = path.parent() {
        std::fs::DirBuilder::new()
            .recursive(true)
            .mode(0o700)
            .create(directory)?;
    }
    OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .open(path)
}

fn sign(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    file.write_all(std::process::id().to_string().as_bytes())
}

fn refusal(robot: &RobotName, mut file: &File) -> OpenError {
    let mut text = String::new();
    let pid = file
        .read_to_string(&mut text)
        .ok()
        .and_then(|_| text.parse().ok());
    OpenError::AlreadyClaimed {
        robot: robot.as_str().into(),
        pid,
    }
}
