//! In `/dev/shm`: the bells of those who waited, and what was opened to a group.
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, CWD};

use super::Turn;
use crate::private::own_user;
use crate::space::bells::{BELL, is_dead};
use crate::space::group::{DOOR, is_dead_page};

/// Removes those which nobody would hear.
pub(super) fn remove(segments: &[PathBuf], turn: Turn) -> usize {
    turn.of(segments)
        .filter(|path| is_dead_socket(path) || is_ours(path) && is_dead_page(path))
        // No other one ever gets its number.
        .filter(|path| rustix::fs::unlinkat(CWD, path.as_path(), AtFlags::empty()).is_ok())
        .count()
}

fn is_dead_socket(path: &Path) -> bool {
    let is_named = [BELL, DOOR]
        .iter()
        .any(|end| super::name(path).ends_with(end));
    let is_socket = path
        .symlink_metadata()
        .is_ok_and(|it| it.file_type().is_socket());
    is_named && is_socket && is_ours(path) && is_dead(path)
}

fn is_ours(path: &Path) -> bool {
    path.symlink_metadata()
        .is_ok_and(|found| found.uid() == own_user())
}
