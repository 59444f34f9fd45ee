//! Whether there is room for iceoryx2's files below the root, before it finds out half-way.
use std::path::Path;

use rustix::io::Errno;

/// A daemon of a robot with a few neighbours makes about 40 files, each smaller than a page.
const ROOM: u64 = 64 * 4096;
const FILES: u64 = 64;

/// # Errors
/// What the kernel would say.
pub(crate) fn check(root: &Path) -> Result<(), Errno> {
    let disk = rustix::fs::statvfs(root)?;
    let room = disk.f_bavail.saturating_mul(disk.f_frsize);
    // Some file systems do not count files.
    let files = if disk.f_files == 0 {
        FILES
    } else {
        disk.f_favail
    };
    if disk.f_flag.contains(rustix::fs::StatVfsMountFlags::RDONLY) {
        Err(Errno::ROFS)
    } else if room < ROOM || files < FILES {
        Err(Errno::NOSPC)
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn here_is_room_and_in_procfs_is_none() {
        let directory = tempfile::tempdir().unwrap();
        assert_eq!(check(directory.path()), Ok(()));
        assert_eq!(check(Path::new("/proc")), Err(Errno::NOSPC));
    }
}
