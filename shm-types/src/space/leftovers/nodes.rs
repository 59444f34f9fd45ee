//! Below `nodes`: for each who takes part three files, and a directory of what it uses.
//!
//! iceoryx2 cleans up after a dead node if these are complete. If not, it never looks at them, or stops looking at any.
//! Most that are not were never more. One that has places in services was, and is made complete again: only iceoryx2
//! gives them back, and without that a service is full for as long as somebody uses it.
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Result, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::Mode;

use super::{Found, Lease, Turn};

const DIRECTORY: &str = "nodes";
const DETAILS: &str = "node.details";
/// In a node's directory, for each service in which it has places.
const TAG: &str = ".service_tag";

/// By which a process says who it is: the first to be made and the last to go. Who lives holds it.
const CONTEXT: &str = ".node_monitor_context";
const CONTEXT_LENGTH: u64 = 16;
/// A process that there never was.
const NOBODY: [u8; 16] = [0; 16];
/// What it locks while it lives, and what who cleans up locks. They must not be opened here: by closing them, a process
/// would unlock its own.
const LOCKS: [&str; 2] = [".node_monitor", ".node_monitor_owner_lock"];

/// Of files that are being made.
const UNFINISHED: Mode = Mode::WUSR;

/// Whoever makes a directory has a file in it after this time.
const MOMENT: Duration = Duration::from_secs(1);

#[derive(Debug)]
struct Node {
    context: Option<Found>,
    context_path: PathBuf,
    locks: Vec<Found>,
    directory: PathBuf,
    details: Option<Found>,
}

/// Removes those which are incomplete, and of nobody.
pub(crate) fn remove(root: &Path, prefix: &str, turn: Turn) -> usize {
    let nodes = root.join(DIRECTORY);
    let numbers: BTreeSet<_> = super::list(&nodes)
        .map(|path| number(&path, prefix))
        .collect();
    let numbers: Vec<_> = numbers.into_iter().collect();
    turn.of(&numbers)
        .map(|number| Node::look(&nodes, prefix, number).remove_if_dead())
        .sum()
}

/// Of a node's file, or of its directory, which has no other name.
fn number(path: &Path, prefix: &str) -> String {
    let name = super::name(path);
    let monitor = name.strip_prefix(prefix).unwrap_or(name);
    let mut endings = LOCKS.iter().chain([&CONTEXT]);
    let number = endings.find_map(|ending| monitor.strip_suffix(ending));
    number.unwrap_or(name).to_owned()
}

impl Node {
    fn look(nodes: &Path, prefix: &str, number: &str) -> Self {
        let path = |ending| nodes.join(format!("{prefix}{number}{ending}"));
        let directory = nodes.join(number);
        Self {
            context: Found::look(path(CONTEXT)),
            context_path: path(CONTEXT),
            locks: LOCKS
                .map(path)
                .into_iter()
                .filter_map(Found::look)
                .collect(),
            details: Found::look(directory.join(format!("{prefix}{DETAILS}"))),
            directory,
        }
    }

    fn remove_if_dead(&self) -> usize {
        if self.is_complete() {
            return 0;
        }
        let witness = self.context.as_ref().or(self.details.as_ref());
        match witness.map(Lease::take) {
            // All that it has is iceoryx2's to remove.
            Some(Some(_lease)) if self.has_places() && self.name().is_ok() => 0,
            Some(Some(_lease)) => self.remove(),
            None if self.locks.is_empty() && self.has_rested() => self.remove(),
            _ => 0,
        }
    }

    fn is_complete(&self) -> bool {
        let context = |file: &Found| file.mode != UNFINISHED && file.length == CONTEXT_LENGTH;
        self.details.is_some() && self.context.as_ref().is_some_and(context) && self.has_locks()
    }

    fn has_locks(&self) -> bool {
        self.locks.len() == LOCKS.len() && self.locks.iter().all(|file| file.mode != UNFINISHED)
    }

    /// Whoever gives them back has removed these tags before any of its other files.
    fn has_places(&self) -> bool {
        let mut used = super::list(&self.directory);
        self.details.is_some()
            && self.has_locks()
            && used.any(|path| super::name(&path).ends_with(TAG))
    }

    /// Says anew whose node it is: nobody's.
    fn name(&self) -> Result<()> {
        let made = self.directory.join("context");
        // Of somebody who died before it had its name.
        let _ = std::fs::remove_file(&made);
        let mut file = File::options()
            .write(true)
            .create_new(true)
            .mode(Mode::RUSR.as_raw_mode())
            .open(&made)?;
        file.write_all(&NOBODY)?;
        std::fs::rename(&made, &self.context_path)
    }

    fn has_rested(&self) -> bool {
        let modified = self.directory.metadata().and_then(|found| found.modified());
        let age = modified.map(|modified| modified.elapsed());
        age.is_ok_and(|age| age.is_ok_and(|age| age > MOMENT))
    }

    fn remove(&self) -> usize {
        let contents: Vec<_> = super::list(&self.directory)
            .filter_map(Found::look)
            .collect();
        let files = contents.iter().chain(&self.locks).chain(&self.context);
        let removed = files.filter(|file| file.remove()).count();
        // Not if somebody has put something in it.
        removed + usize::from(std::fs::remove_dir(&self.directory).is_ok())
    }
}
