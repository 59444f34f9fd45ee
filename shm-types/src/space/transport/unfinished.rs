//! A file that nobody finds before it is complete: who dies while making it leaves nothing under its name.
use std::ffi::OsString;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use rustix::fs::{AtFlags, CWD, Mode, OFlags};
use rustix::io::{Errno, Result};

/// What a file is called meanwhile where the file system wants a name (before it: process, number).
const SUFFIX: &str = ".unfinished";

const PRIVATE: Mode = Mode::RUSR.union(Mode::WUSR);

/// A file for `target`, open for reading and writing.
#[derive(Debug)]
pub(super) struct Unfinished {
    file: OwnedFd,
    target: PathBuf,
    name: Option<PathBuf>,
}

impl Unfinished {
    pub(super) fn new(target: PathBuf) -> Result<Self> {
        let directory = target.parent().unwrap_or(Path::new("/"));
        let flags = OFlags::RDWR | OFlags::CLOEXEC;
        match rustix::fs::open(directory, flags | OFlags::TMPFILE, PRIVATE) {
            Ok(file) => Ok(Self {
                file,
                target,
                name: None,
            }),
            // Not every file system has files without a name.
            Err(Errno::OPNOTSUPP | Errno::ISDIR | Errno::INVAL) => Self::named(target),
            Err(error) => Err(error),
        }
    }

    fn named(target: PathBuf) -> Result<Self> {
        let name = beside(&target);
        let flags = OFlags::RDWR | OFlags::CLOEXEC | OFlags::CREATE | OFlags::EXCL;
        Ok(Self {
            file: rustix::fs::open(&name, flags, PRIVATE)?,
            target,
            name: Some(name),
        })
    }

    /// Gives it `mode` and its name, unless there is something of that name.
    pub(super) fn publish(&self, mode: Mode) -> Result<()> {
        rustix::fs::fchmod(&self.file, mode)?;
        let source = self
            .name
            .clone()
            .unwrap_or_else(|| format!("/proc/self/fd/{}", self.file.as_raw_fd()).into());
        rustix::fs::linkat(CWD, &source, CWD, &self.target, AtFlags::SYMLINK_FOLLOW)
    }
}

impl AsFd for Unfinished {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.file.as_fd()
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if let Some(name) = &self.name {
            // If it stays, it is removed with what the dead leave.
            let _ = rustix::fs::unlink(name);
        }
    }
}

fn beside(target: &Path) -> PathBuf {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let number = COUNTER.fetch_add(1, Ordering::Relaxed);
    let mut name = OsString::from(target);
    name.push(format!(".{}.{number}{SUFFIX}", std::process::id()));
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(make: impl Fn(PathBuf) -> Result<Unfinished>) {
        let directory = tempfile::tempdir().unwrap();
        let target = directory.path().join("file");
        let entries = || std::fs::read_dir(directory.path()).unwrap().count();

        drop(make(target.clone()).unwrap());
        assert_eq!(entries(), 0, "what is not published leaves nothing");

        let file = make(target.clone()).unwrap();
        assert!(!target.exists());
        file.publish(Mode::RUSR).unwrap();
        assert_eq!(
            make(target.clone()).unwrap().publish(Mode::RUSR),
            Err(Errno::EXIST)
        );
        drop(file);
        assert!(target.exists() && entries() == 1);
    }

    #[test]
    fn it_appears_complete_or_not_at_all() {
        check(Unfinished::new);
    }

    #[test]
    fn it_does_so_where_every_file_has_a_name() {
        check(Unfinished::named);
    }
}
