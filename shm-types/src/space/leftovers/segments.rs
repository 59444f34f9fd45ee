//! In `/dev/shm`.
use std::io::Read;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags};

use super::{Found, Turn, remove_unless_held};
use crate::space::config::Place;
use crate::space::transport::{SHARED_MEMORY, is_complete};

/// A counter that nobody holds between two uses.
const COUNTER: &str = ".global_mgmt";

/// All segments of the space.
pub(super) fn list(place: &Place) -> Vec<PathBuf> {
    super::list(Path::new(SHARED_MEMORY))
        .filter(|path| super::name(path).starts_with(place.prefix()))
        .collect()
}

/// Removes those which nobody holds.
pub(super) fn remove(segments: &[PathBuf], turn: Turn) -> usize {
    turn.of(segments)
        .filter_map(|path| Found::look(path.clone()))
        .filter(|file| !file.name().ends_with(COUNTER) || is_unusable(file))
        .map(|file| remove_unless_held(&[&file]))
        .sum()
}

fn is_unusable(file: &Found) -> bool {
    !file.mode.contains(Mode::RUSR | Mode::WUSR)
        || beginning(&file.path).is_some_and(|bytes| !is_complete(&bytes, file.length))
}

/// `None` if it could not be read, so that nothing is known.
fn beginning(path: &Path) -> Option<Vec<u8>> {
    let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits().cast_signed();
    let file = std::fs::OpenOptions::new()
        .read(true)
        .custom_flags(flags)
        .open(path)
        .ok()?;
    let mut bytes = Vec::new();
    file.take(16).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}
