//! Who is in the space, and who takes out what is left of the dead.
//!
//! Everybody inside holds a shared lock (flock) on the root directory itself, which the kernel gives back even after
//! kill -9. Who comes or goes tries for the exclusive lock: with it, nobody else is inside, and everything found is a
//! leftover. Two who leave at once give up their shared locks one after the other, so the later one gets it. Whoever was
//! killed may hold its lock a moment longer; what stays behind then is removed by whoever comes next.
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::File;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use iceoryx2::node::NodeState;
use iceoryx2::prelude::CallbackProgression;
use rustix::fs::{AtFlags, FileType};

use super::config::{self, Place};
use super::error::{Lost, OpenError, Remark};
use super::gate::Gate;
use super::key::{self, Key};
use super::leftovers::Turn;
use super::manner::Manner;
use super::services::{self, Services};
use super::{Node, claim, ground, leftovers, lock, segments};
use crate::private::PrivateDirectory;

const NODES: &str = "nodes";
const SERVICES: &str = services::DIRECTORY;

/// These are directories.
const DIRECTORIES: [&str; 3] = [NODES, SERVICES, claim::DIRECTORY];

/// What a space consists of, below its root.
const OURS: [&str; 4] = [NODES, SERVICES, claim::DIRECTORY, key::FILE];

/// By these it is noticed that somebody deletes or exchanges them.
const WATCHED: [&str; 3] = [NODES, SERVICES, key::FILE];

/// iceoryx2's name for the file by which a node shows that it lives.
const MONITOR: &str = ".node_monitor";

/// Room to start with (bytes): one robot with all its publishers takes 0.6 MB.
const ROOM: u64 = 4 << 20;

/// Between two looks at a space that somebody else is just leaving.
const PAUSE: Duration = Duration::from_millis(2);

/// The right to be in a space; dropped last, after everything that is in it.
#[derive(Debug)]
pub(crate) struct Residence {
    place: Place,
    directory: PrivateDirectory,
    /// Locked as well, in case the directory goes.
    life: Option<File>,
    remarks: Vec<Remark>,
    gate: Gate,
    services: Services,
    watched: [OnceLock<(u64, u64)>; WATCHED.len()],
}

impl Residence {
    pub(crate) fn enter(root: &Path, prefix: &str, manner: Manner) -> Result<Self, OpenError> {
        config::check(root, prefix)?;
        ground::check()?;
        let directory = match manner {
            Manner::Make => PrivateDirectory::make(root, is_ours)?,
            Manner::Find => PrivateDirectory::open(root, is_ours)?,
        };
        config::check(directory.path(), prefix)?;
        let mut remarks: Vec<_> = directory
            .former_mode()
            .map(|mode| Remark::Closed {
                root: directory.path().into(),
                mode,
            })
            .into_iter()
            .chain(segments::loose_mode().map(|mode| Remark::Loose { mode }))
            .collect();
        for name in DIRECTORIES {
            directory.unlock(name)?;
        }
        let deadline = Instant::now() + lock::PATIENCE;
        let key = join(&directory, deadline, &mut remarks)?;
        let place = Place::new(directory.path(), prefix, key)?;
        let space = place.prefix().trim_end_matches('_').to_owned();
        let life = segments::enter(&space, directory.path(), deadline)?;
        check_room(ROOM)?;
        let gate = Gate::new(directory.file(key::FILE)?);
        remarks.extend(restore(&directory, &gate)?);
        Ok(Self {
            place,
            gate,
            services: Services::default(),
            directory,
            life: Some(life),
            remarks,
            watched: [const { OnceLock::new() }; WATCHED.len()],
        })
    }

    pub(crate) fn place(&self) -> &Place {
        &self.place
    }

    pub(crate) fn directory(&self) -> &PrivateDirectory {
        &self.directory
    }

    pub(crate) fn gate(&self) -> &Gate {
        &self.gate
    }

    pub(crate) fn services(&self) -> &Services {
        &self.services
    }

    pub(crate) fn remarks(&self) -> &[Remark] {
        &self.remarks
    }

    pub(crate) fn remark(&mut self, remark: Remark) {
        self.remarks.push(remark);
    }

    /// Whether the directory, what is in it, and what is in `/dev/shm` are still those of the beginning.
    pub(crate) fn check(&self) -> Result<(), Lost> {
        let root = self.directory.path();
        if !self.directory.is_in_place() {
            return Err(Lost(root.into()));
        }
        for (name, first) in WATCHED.iter().zip(&self.watched) {
            let now = identity(&self.directory, name);
            // What was never there cannot be lost: iceoryx2 makes it when it is needed.
            let lost = match (first.get(), now) {
                (Some(first), now) => now != Some(*first),
                (None, Some(now)) => first.set(now).is_err(),
                (None, None) => *name != SERVICES,
            };
            if lost {
                return Err(Lost(root.join(name)));
            }
        }
        match &self.life {
            Some(life) if !segments::is_in_place(life) => Err(Lost(segments::SHARED_MEMORY.into())),
            _ => self.services.check(),
        }
    }
}

impl Drop for Residence {
    fn drop(&mut self) {
        self.life = None;
        if lock::try_alone(&self.directory) && self.directory.is_in_place() {
            // What cannot be removed now will be at the next start, which reports it.
            let _ = clean(&self.directory);
        }
    }
}

fn is_ours(name: &OsStr) -> bool {
    OURS.iter().any(|ours| name == *ours)
}

/// Takes the shared lock, and cleans up before if nobody is inside.
fn join(
    directory: &PrivateDirectory,
    deadline: Instant,
    remarks: &mut Vec<Remark>,
) -> Result<Key, OpenError> {
    loop {
        if lock::try_alone(directory) {
            remarks.extend(begin(directory)?);
        }
        lock::share(directory, directory.path(), deadline)?;
        // Meanwhile somebody may have left as the last one, or deleted it.
        match Key::read(directory)? {
            Some(key) => return Ok(key),
            None if Instant::now() > deadline => return Err(lock::emptied(directory.path())),
            None => {
                // Several who waited with their locks would keep each other from ever being alone.
                lock::give_back(directory);
                std::thread::sleep(PAUSE);
            }
        }
    }
}

/// For who is alone: an empty space with a key.
fn begin(directory: &PrivateDirectory) -> Result<Option<Remark>, OpenError> {
    check_ours(directory)?;
    let remark = clean(directory)?;
    if Key::read(directory)?.is_none() {
        Key::draw(directory)?;
    }
    Ok(remark)
}

/// Removes what somebody has put into the place of a directory. Those inside notice, as they do when it is deleted; who comes
/// makes it anew. A link counts as well, wherever it leads.
fn restore(directory: &PrivateDirectory, gate: &Gate) -> Result<Vec<Remark>, OpenError> {
    let _pass = gate.pass();
    let mut remarks = Vec::new();
    for name in DIRECTORIES {
        if is_no_directory(directory, name) {
            directory.remove(name.as_ref())?;
            let path = directory.path().join(name);
            remarks.push(Remark::Restored { path });
        }
    }
    Ok(remarks)
}

fn is_no_directory(directory: &PrivateDirectory, name: &str) -> bool {
    let found = rustix::fs::statat(directory, name, AtFlags::SYMLINK_NOFOLLOW);
    found.is_ok_and(|found| FileType::from_raw_mode(found.st_mode) != FileType::Directory)
}

fn check_ours(directory: &PrivateDirectory) -> Result<(), OpenError> {
    let foreign = directory
        .entries()?
        .into_iter()
        .find(|entry| !is_ours(entry));
    foreign.map_or(Ok(()), |entry| {
        Err(OpenError::NotOurs {
            root: directory.path().into(),
            entry: entry.to_string_lossy().into_owned(),
        })
    })
}

/// For who is alone: removes everything, unless a program that does not know of the locks may be alive in the space.
fn clean(directory: &PrivateDirectory) -> Result<Option<Remark>, OpenError> {
    let root = directory.path();
    if is_inhabited(directory) {
        return Ok(Some(Remark::Kept { root: root.into() }));
    }
    let was_empty = directory.entries()?.is_empty();
    let key = Key::read(directory).unwrap_or_default();
    let files = segments::sweep(root, key).map_err(|source| OpenError::System {
        action: "clean up",
        path: segments::SHARED_MEMORY.into(),
        source,
    })?;
    // The key last: it tells which segments are to be removed.
    for name in OURS {
        directory.remove(name.as_ref())?;
    }
    Ok((files > 0 || !was_empty).then(|| Remark::Swept {
        root: root.into(),
        files,
    }))
}

/// Whether a node may be alive, under any prefix.
fn is_inhabited(directory: &PrivateDirectory) -> bool {
    let root = directory.path();
    match prefixes(&root.join(NODES)) {
        Ok(prefixes) => prefixes.iter().any(|prefix| is_alive(root, prefix)),
        Err(error) => error.kind() != ErrorKind::NotFound,
    }
}

/// The full prefixes under which nodes are or were.
fn prefixes(nodes: &Path) -> std::io::Result<BTreeSet<String>> {
    let mut prefixes = BTreeSet::new();
    for entry in std::fs::read_dir(nodes)? {
        let name = entry?.file_name();
        if let Some(node) = name.to_str().and_then(|name| name.strip_suffix(MONITOR)) {
            let prefix = node.trim_end_matches(|digit: char| digit.is_ascii_digit());
            prefixes.insert(prefix.to_owned());
        }
    }
    Ok(prefixes)
}

/// If that cannot be told, there may be somebody.
fn is_alive(root: &Path, prefix: &str) -> bool {
    let Ok(config) = config::configure(root, prefix) else {
        return true;
    };
    // One of which nothing can be read would hide all others.
    leftovers::remove_nodes(root, prefix, Turn::ALL);
    let mut alive = false;
    let listed = Node::list(&config, |node| {
        alive |= !matches!(node, NodeState::Dead(_));
        CallbackProgression::Continue
    });
    alive || listed.is_err()
}

fn identity(directory: &PrivateDirectory, name: &str) -> Option<(u64, u64)> {
    let stat = rustix::fs::statat(directory, name, AtFlags::SYMLINK_NOFOLLOW).ok()?;
    Some((stat.st_dev, stat.st_ino))
}

fn check_room(wanted: u64) -> Result<(), OpenError> {
    let memory =
        rustix::fs::statvfs(segments::SHARED_MEMORY).map_err(|error| OpenError::System {
            action: "look at",
            path: segments::SHARED_MEMORY.into(),
            source: error.into(),
        })?;
    let free = memory.f_bavail.saturating_mul(memory.f_frsize);
    if free < wanted {
        Err(OpenError::NoRoom { free, wanted })
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_little_room_is_refused_with_the_figures() {
        assert!(check_room(0).is_ok());
        let refusal = check_room(u64::MAX).unwrap_err();
        assert!(matches!(refusal, OpenError::NoRoom { free, wanted: u64::MAX } if free > 0));
    }

    /// iceoryx2 says nothing of nodes that it cannot look at.
    #[test]
    fn where_nodes_cannot_be_listed_somebody_may_live() {
        let directory = tempfile::tempdir().unwrap();
        let root = directory.path();
        std::fs::create_dir(root.join(NODES)).unwrap();
        assert!(!is_alive(root, "t_"));
        std::fs::remove_dir(root.join(NODES)).unwrap();
        std::fs::write(root.join(NODES), "not a directory").unwrap();
        assert!(is_alive(root, "t_"));
    }
}
