//! Who runs on this computer, for whoever only looks: nothing is made, and nobody is kept from starting.
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::claim::{self, Claimant};
use super::error::OpenError;
use super::gate::Gate;
use super::group;
use super::key;
use super::lock;
use super::segments;
use crate::RobotName;
use crate::private::{OwnFile, own_user};

/// A robot for which a process acts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Running {
    /// Its name.
    pub robot: RobotName,
    /// Its number in the team and the process, if it has said so.
    pub who: Option<(u16, u32)>,
    /// When that process began to act for it, by the clock of the day.
    pub since: Option<SystemTime>,
}

/// Those for whom a living process has a claim below `root`, by name.
pub(super) fn running(root: &Path) -> Result<Vec<Running>, OpenError> {
    if is_anothers(root) {
        return group::running(root);
    }
    if !is_there(root)? {
        return Ok(Vec::new());
    }
    // Who tries a lock has it for a moment. With the turn, nobody is just taking a claim, who would be refused for that.
    let _pass = Gate::new(OwnFile::named(&root.join(key::FILE))?).pass();
    let claims = root.join(claim::DIRECTORY);
    let mut found: Vec<_> = names(&claims)?
        .iter()
        .filter_map(|name| RobotName::new(name.to_str()?).ok())
        .filter_map(|robot| acting(&claims, robot))
        .collect();
    found.sort_by(|one, other| one.robot.cmp(&other.robot));
    Ok(found)
}

/// Whether it is another user's, as far as that can be seen.
pub(super) fn is_anothers(root: &Path) -> bool {
    group::owner(root).is_some_and(|owner| owner != own_user())
}

/// `Ok(false)` if there is nothing.
fn is_there(root: &Path) -> Result<bool, OpenError> {
    match root.metadata() {
        Ok(_) => Ok(true),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(source) => Err(look_at(root, source)),
    }
}

fn names(claims: &Path) -> Result<Vec<OsString>, OpenError> {
    let entries = match std::fs::read_dir(claims) {
        Ok(entries) => entries,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(look_at(claims, error)),
    };
    entries
        .map(|entry| entry.map(|entry| entry.file_name()))
        .collect::<std::io::Result<_>>()
        .map_err(|error| look_at(claims, error))
}

fn look_at(path: &Path, source: std::io::Error) -> OpenError {
    OpenError::System {
        action: "look at",
        path: path.into(),
        source,
    }
}

/// `None` if whoever acted for it is gone: the kernel has given the lock back.
fn acting(claims: &Path, robot: RobotName) -> Option<Running> {
    let file = OwnFile::named(&claims.join(robot.as_str())).ok()?;
    let file = file.existing().ok()??;
    if lock::try_alone(&file) {
        return None;
    }
    let since = file.metadata().ok().and_then(|found| found.modified().ok());
    Some(Running {
        robot,
        who: Claimant::read(&file).map(|claimant| claimant.number_and_process()),
        since,
    })
}

/// Root and prefix of all spaces that this user's processes have or had on this computer, and of others that it may read.
pub(super) fn places() -> Vec<(PathBuf, String)> {
    let mut all: Vec<_> = segments::list()
        .unwrap_or_default()
        .iter()
        .filter_map(|name| segments::place_of(name))
        .chain(group::places())
        .collect();
    all.sort();
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_nothing_is_nobody_runs_and_nothing_is_made() {
        let directory = tempfile::tempdir().unwrap();
        let root = directory.path().join("shm");
        assert_eq!(running(&root).unwrap(), []);
        assert!(!root.exists());
        std::fs::create_dir(&root).unwrap();
        assert_eq!(running(&root).unwrap(), []);
        assert_eq!(std::fs::read_dir(&root).unwrap().count(), 0);
    }

    #[test]
    fn what_is_not_ours_is_refused_with_its_owner() {
        let directory = tempfile::tempdir().unwrap();
        let strangers = if own_user() == 0 {
            std::os::unix::fs::chown(directory.path(), Some(65534), None).unwrap();
            directory.path()
        } else {
            Path::new("/usr")
        };
        let refusal = running(strangers).unwrap_err().to_string();
        assert!(refusal.contains("belongs to user "), "{refusal}");
    }
}
