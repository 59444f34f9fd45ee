//! The proof that nobody holds a file.
#![expect(unsafe_code, reason = "no library knows leases")]

use std::ffi::c_int;
use std::fs::File;
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;

use rustix::fs::{Mode, OFlags};

use super::Found;

/// A write lease (fcntl(2)): the kernel gives it only if no process has the file open or mapped, in whatever container,
/// and lets nobody open it meanwhile.
#[derive(Debug)]
pub(super) struct Lease {
    // Closing it gives the lease back.
    _file: File,
}

impl Lease {
    /// `None` if somebody holds the file, if it is another one by now, or if the file system has no leases.
    pub(super) fn take(found: &Found) -> Option<Self> {
        let access = if found.mode.contains(Mode::RUSR) {
            OFlags::RDONLY
        } else {
            OFlags::WRONLY
        };
        let flags = access | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let file = File::from(rustix::fs::open(&found.path, flags, Mode::empty()).ok()?);
        let metadata = file.metadata().ok()?;
        let same = (metadata.dev(), metadata.ino()) == found.identity;
        (same && lease(&file)).then_some(Self { _file: file })
    }
}

fn lease(file: &File) -> bool {
    // Who opens the file meanwhile makes the kernel send a signal: SIGIO would end the process, SIGURG is ignored.
    control(file, F_SETSIG, libc::SIGURG) && control(file, libc::F_SETLEASE, libc::F_WRLCK)
}

/// Missing in the libc crate.
const F_SETSIG: c_int = 10;

fn control(file: &File, command: c_int, argument: c_int) -> bool {
    // SAFETY: the descriptor is open, and these commands take a number.
    unsafe { libc::fcntl(file.as_raw_fd(), command, argument) == 0 }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::ptr::null_mut;

    use rustix::mm::{MapFlags, ProtFlags};

    use super::*;

    fn found(directory: &tempfile::TempDir) -> (File, Found) {
        let path = directory.path().join("file");
        let mut file = File::create_new(&path).unwrap();
        file.write_all(&[1; 4096]).unwrap();
        (file, Found::look(path).unwrap())
    }

    #[test]
    fn what_is_open_is_not_given() {
        let directory = tempfile::tempdir().unwrap();
        let (file, found) = found(&directory);
        assert!(Lease::take(&found).is_none());
        drop(file);
        let lease = Lease::take(&found).unwrap();
        assert!(Lease::take(&found).is_none(), "given once");
        drop(lease);
        assert!(Lease::take(&found).is_some());
    }

    #[test]
    fn what_is_mapped_is_not_given() {
        let directory = tempfile::tempdir().unwrap();
        let (file, found) = found(&directory);
        drop(file);
        let file = File::open(&found.path).unwrap();
        // SAFETY: the kernel chooses where, and nobody reads it.
        let base = unsafe {
            rustix::mm::mmap(
                null_mut(),
                4096,
                ProtFlags::READ,
                MapFlags::SHARED,
                &file,
                0,
            )
            .unwrap()
        };
        drop(file);
        assert!(Lease::take(&found).is_none());
        // SAFETY: as it was mapped.
        unsafe { rustix::mm::munmap(base, 4096).unwrap() };
        assert!(Lease::take(&found).is_some());
    }

    #[test]
    fn another_file_of_that_name_is_not_given() {
        let directory = tempfile::tempdir().unwrap();
        let (file, first) = found(&directory);
        std::fs::rename(&first.path, directory.path().join("kept")).unwrap();
        drop(file);
        let (second, _) = found(&directory);
        drop(second);
        assert!(Lease::take(&first).is_none());
    }
}
