//! A directory of ours lets us in, whatever a umask or a mistake has taken away.
use std::os::fd::{AsRawFd, OwnedFd};
use std::path::Path;

use rustix::fs::{Mode, OFlags, Stat};

use super::error::NotPrivate;

/// Enough to look at it and to change its mode, whatever that is.
pub(super) const HANDLE: OFlags = OFlags::PATH
    .union(OFlags::DIRECTORY)
    .union(OFlags::NOFOLLOW)
    .union(OFlags::CLOEXEC);

/// Gives its owner all rights to the directory behind the [`HANDLE`], and nobody else any; whether they were missing. Without
/// them nobody can see what is in it.
pub(super) fn let_in(directory: &OwnedFd, found: &Stat, path: &Path) -> Result<bool, NotPrivate> {
    let mode = Mode::from_raw_mode(found.st_mode);
    if mode.contains(Mode::RWXU) {
        return Ok(false);
    }
    set_mode(directory, mode | Mode::RWXU)
        .map_err(NotPrivate::system("open to its owner (chmod u+rwx)", path))?;
    Ok(true)
}

/// The kernel takes no such handle itself (`EBADF`), but its name below /proc.
pub(super) fn set_mode(directory: &OwnedFd, mode: Mode) -> rustix::io::Result<()> {
    rustix::fs::chmod(format!("/proc/self/fd/{}", directory.as_raw_fd()), mode)
}
