//! In `/dev/shm`: the bells of those who waited.
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, CWD};

use super::Turn;
use crate::private::own_user;
use crate::space::bells::{BELL, is_dead};

/// Removes those which nobody would hear.
pub(super) fn remove(segments: &[PathBuf], turn: Turn) -> usize {
    turn.of(segments)
        .filter(|path| super::name(path).ends_with(BELL) && is_ours(path) && is_dead(path))
        // No other one ever gets its number.
        .filter(|path| rustix::fs::unlinkat(CWD, path.as_path(), AtFlags::empty()).is_ok())
        .count()
}

fn is_ours(path: &Path) -> bool {
    let found = path.symlink_metadata();
    found.is_ok_and(|found| found.file_type().is_socket() && found.uid() == own_user())
}
