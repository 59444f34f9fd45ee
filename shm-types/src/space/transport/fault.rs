//! What the kernel refused while iceoryx2 was at work, which itself says no more than `InternalError`.
use std::cell::Cell;

use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;

use crate::advice;

/// Where something was to be made.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Site {
    /// In `/dev/shm`.
    Memory,
    /// Below the root directory.
    Root,
}

impl Site {
    /// What a person can do about it.
    pub(crate) const fn advice(self, error: Errno) -> &'static str {
        match (error, self) {
            (Errno::MFILE | Errno::NFILE, _) => advice::FILES,
            (Errno::NOMEM | Errno::AGAIN, _) => {
                "allow more memory, or more of it locked (ulimit -v, ulimit -l; LimitMEMLOCK= in a unit)"
            }
            (_, Self::Memory) => {
                "check that /dev/shm is mounted and writable, has room, and holds no files of another user that begin with the prefix"
            }
            (_, Self::Root) => {
                "check that the disk of the shared-memory root is writable and has room (df, df -i)"
            }
        }
    }
}

thread_local! {
    static LAST: Cell<Option<(Site, Errno)>> = const { Cell::new(None) };
}

/// That there is one already is an answer, no refusal.
pub(super) fn note(site: Site) -> impl FnOnce(Errno) -> Errno {
    move |error| {
        if error != Errno::EXIST {
            LAST.set(Some((site, error)));
        }
        error
    }
}

/// What was refused last on this thread, once.
pub(crate) fn take() -> Option<(Site, Errno)> {
    LAST.take()
}

/// As [`take`]; or that files are few, which iceoryx2 meets in places where nobody notes it.
pub(crate) fn take_or_ask() -> Option<(Site, Errno)> {
    take().or_else(|| Some((Site::Root, few_files()?)))
}

/// More than are opened at once, and closed again.
const FILES: usize = 8;

fn few_files() -> Option<Errno> {
    let open = || rustix::fs::open("/dev/null", OFlags::RDONLY | OFlags::CLOEXEC, Mode::empty());
    let opened: Result<Vec<_>, _> = (0..FILES).map(|_| open()).collect();
    let few = |error: &Errno| matches!(*error, Errno::MFILE | Errno::NFILE);
    opened.err().filter(few)
}

/// As [`take`], and leaves it there.
pub(crate) fn peek() -> Option<(Site, Errno)> {
    LAST.get()
}
