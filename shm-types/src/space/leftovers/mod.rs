//! What the dead have left that iceoryx2 does not clean up: files half-made, cut off, without the other half, or of a
//! service of which the last one died while leaving.
//!
//! Whoever uses or makes a file has it open or mapped, however long it is stopped. So what nobody holds is dead, and the
//! kernel tells ([`Lease`]). Where it does not, files stay until the space is empty.
mod bells;
mod broom;
mod lease;
mod nodes;
mod segments;
mod services;

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, CWD, Mode};

use super::Node;
use super::config::Place;
pub(super) use broom::{Broom, Turn};
use lease::Lease;
pub(super) use nodes::remove as remove_nodes;
pub(super) use services::remove_headless;

/// A file as it was found.
#[derive(Clone, Debug)]
struct Found {
    path: PathBuf,
    /// Device and inode.
    identity: (u64, u64),
    mode: Mode,
    length: u64,
}

/// Removes it while others live, and what iceoryx2 does clean up with it; says how many files it was, iceoryx2's not counted.
pub(crate) fn remove(place: &Place, turn: Turn) -> usize {
    // First what keeps iceoryx2 from its part.
    let nodes = nodes::remove(place.root(), place.prefix(), turn);
    Node::try_cleanup_dead_nodes(place.config());
    let segments = segments::list(place);
    nodes
        + services::remove(place, &segments, turn)
        + bells::remove(&segments, turn)
        + segments::remove(&segments, turn)
}

/// Removes the file at `path`, if nobody holds it.
pub(crate) fn remove_unheld(path: &Path) {
    if let Some(file) = Found::look(path.into()) {
        remove_unless_held(&[&file]);
    }
}

impl Found {
    /// What is there, if it is a file and ours.
    fn look(path: PathBuf) -> Option<Self> {
        let metadata = path.symlink_metadata().ok()?;
        let ours = metadata.uid() == rustix::process::geteuid().as_raw();
        (ours && metadata.is_file()).then(|| Self {
            path,
            identity: (metadata.dev(), metadata.ino()),
            mode: Mode::from_raw_mode(metadata.mode()),
            length: metadata.len(),
        })
    }

    fn name(&self) -> &str {
        name(&self.path)
    }

    /// Removes it, if it is still the same.
    fn remove(&self) -> bool {
        Self::look(self.path.clone()).is_some_and(|now| now.identity == self.identity)
            && rustix::fs::unlinkat(CWD, &self.path, AtFlags::empty()).is_ok()
    }
}

fn name(path: &Path) -> &str {
    let name = path.file_name().and_then(|name| name.to_str());
    name.unwrap_or_default()
}

/// Removes files that go together, if nobody holds any of them.
fn remove_unless_held(files: &[&Found]) -> usize {
    let leases: Option<Vec<_>> = files.iter().map(|file| Lease::take(file)).collect();
    leases.map_or(0, |_leases| {
        files.iter().filter(|file| file.remove()).count()
    })
}

/// The paths in a directory; none if it cannot be read.
fn list(directory: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
    entries.map(|entry| entry.path())
}
