//! Locks that the kernel gives back whatever happens to their holder, and that nobody waits for without end.
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::fs::FlockOperation;
use rustix::io::Errno;

use super::error::OpenError;

/// Cleaning up takes milliseconds; who holds a lock for longer is stopped, or means harm.
pub(super) const PATIENCE: Duration = Duration::from_secs(2);
const PAUSE: Duration = Duration::from_millis(2);

/// Whether nobody else has the lock; a shared one of ours is lost either way.
pub(super) fn try_alone(file: impl AsFd) -> bool {
    rustix::fs::flock(file, FlockOperation::NonBlockingLockExclusive).is_ok()
}

/// Takes it together with others, once nobody has it alone. From exclusive to shared the kernel lets go for a moment.
pub(super) fn share(file: impl AsFd, path: &Path, deadline: Instant) -> Result<(), OpenError> {
    loop {
        match rustix::fs::flock(&file, FlockOperation::NonBlockingLockShared) {
            Ok(()) => return Ok(()),
            Err(Errno::WOULDBLOCK) if Instant::now() < deadline => std::thread::sleep(PAUSE),
            Err(Errno::INTR) => {}
            Err(Errno::WOULDBLOCK) => return Err(locked(path)),
            Err(error) => {
                return Err(OpenError::System {
                    action: "lock",
                    path: path.into(),
                    source: error.into(),
                });
            }
        }
    }
}

pub(super) fn give_back(file: impl AsFd) {
    // If there is none, there is none to give back.
    let _ = rustix::fs::flock(file, FlockOperation::Unlock);
}

/// The refusal, with who holds the lock as far as the kernel says so.
pub(super) fn locked(path: &Path) -> OpenError {
    OpenError::Locked {
        path: path.into(),
        processes: holders(path).unwrap_or_default(),
    }
}

/// The refusal, with who is inside.
pub(super) fn emptied(root: &Path) -> OpenError {
    let own = std::process::id();
    let mut processes = holders(root).unwrap_or_default();
    processes.retain(|process| *process != own);
    OpenError::Emptied {
        root: root.into(),
        processes,
    }
}

fn holders(path: &Path) -> Option<Vec<u32>> {
    let metadata = path.metadata().ok()?;
    let locks = std::fs::read_to_string("/proc/locks").ok()?;
    let (major, minor) = (
        rustix::fs::major(metadata.dev()),
        rustix::fs::minor(metadata.dev()),
    );
    let file = format!("{major:02x}:{minor:02x}:{}", metadata.ino());
    Some(
        locks
            .lines()
            .filter_map(|line| holder(line, &file))
            .collect(),
    )
}

/// Of a line such as `6: FLOCK  ADVISORY  WRITE 1234 00:2d:1553 0 EOF`; who waits has an arrow in front.
fn holder(line: &str, file: &str) -> Option<u32> {
    let fields: Vec<_> = line.split_ascii_whitespace().collect();
    match fields.as_slice() {
        [_, "FLOCK", _, _, process, found, ..] if *found == file => process.parse().ok(),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_holds_it_is_said_in_time() {
        let directory = tempfile::tempdir().unwrap();
        let open = || std::fs::File::open(directory.path()).unwrap();
        let holder = open();
        assert!(try_alone(&holder));
        let refusal = share(open(), directory.path(), Instant::now()).unwrap_err();
        assert!(
            matches!(&refusal, OpenError::Locked { processes, .. } if *processes == [std::process::id()]),
            "{refusal}"
        );
        drop(holder);
        share(open(), directory.path(), Instant::now()).unwrap();
    }
}
