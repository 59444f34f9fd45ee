//! Below `nodes`: for each who takes part three files, and a directory of what it uses.
//!
//! iceoryx2 cleans up after a dead node if these are complete. If not, it never looks at them, or stops looking at any.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::Mode;

use super::{Found, Lease};

const DIRECTORY: &str = "nodes";
const DETAILS: &str = ".details";

/// By which a process says who it is: the first to be made and the last to go. Who lives holds it.
const CONTEXT: &str = ".node_monitor_context";
const CONTEXT_LENGTH: u64 = 16;
/// What it locks while it lives, and what who cleans up locks. They must not be opened here: by closing them, a process
/// would unlock its own.
const LOCKS: [&str; 2] = [".node_monitor", ".node_monitor_owner_lock"];

/// Of files that are being made.
const UNFINISHED: Mode = Mode::WUSR;

/// Whoever makes a directory has a file in it after this time.
const MOMENT: Duration = Duration::from_secs(1);

#[derive(Debug, Default)]
struct Node {
    context: Option<Found>,
    locks: Vec<Found>,
    directory: Option<PathBuf>,
    contents: Vec<Found>,
}

/// Removes those which are incomplete, and of nobody.
pub(crate) fn remove(root: &Path, prefix: &str) -> usize {
    nodes(root, prefix).values().map(Node::remove_if_dead).sum()
}

/// By number.
fn nodes(root: &Path, prefix: &str) -> BTreeMap<String, Node> {
    let mut nodes: BTreeMap<String, Node> = BTreeMap::new();
    for path in super::list(&root.join(DIRECTORY)) {
        let name = super::name(&path).to_owned();
        let monitor = name.strip_prefix(prefix).unwrap_or_default();
        if let Some(number) = monitor.strip_suffix(CONTEXT) {
            nodes.entry(number.into()).or_default().context = Found::look(path);
        } else if let Some(number) = LOCKS.iter().find_map(|lock| monitor.strip_suffix(lock)) {
            nodes
                .entry(number.into())
                .or_default()
                .locks
                .extend(Found::look(path));
        } else if path.symlink_metadata().is_ok_and(|found| found.is_dir()) {
            let node = nodes.entry(name).or_default();
            node.contents = super::list(&path).filter_map(Found::look).collect();
            node.directory = Some(path);
        }
    }
    nodes
}

impl Node {
    fn remove_if_dead(&self) -> usize {
        if self.is_complete() {
            return 0;
        }
        let witness = self.context.as_ref().or_else(|| self.details());
        match witness.map(Lease::take) {
            Some(Some(_lease)) => self.remove(),
            None if self.locks.is_empty() && self.has_rested() => self.remove(),
            _ => 0,
        }
    }

    fn details(&self) -> Option<&Found> {
        self.contents
            .iter()
            .find(|file| file.name().ends_with(DETAILS))
    }

    fn is_complete(&self) -> bool {
        let context = |file: &Found| file.mode != UNFINISHED && file.length == CONTEXT_LENGTH;
        self.details().is_some()
            && self.context.as_ref().is_some_and(context)
            && self.locks.len() == LOCKS.len()
            && self.locks.iter().all(|file| file.mode != UNFINISHED)
    }

    fn has_rested(&self) -> bool {
        let age = |directory: &PathBuf| {
            directory
                .metadata()?
                .modified()?
                .elapsed()
                .map_err(std::io::Error::other)
        };
        self.directory
            .as_ref()
            .is_some_and(|directory| age(directory).is_ok_and(|age| age > MOMENT))
    }

    fn remove(&self) -> usize {
        let files = self.contents.iter().chain(&self.locks).chain(&self.context);
        let removed = files.filter(|file| file.remove()).count();
        // Not if somebody has put something in it.
        let directory = self
            .directory
            .iter()
            .filter(|path| std::fs::remove_dir(path).is_ok());
        removed + directory.count()
    }
}
