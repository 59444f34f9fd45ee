//! Who is in the space, and who takes out what is left of the dead.
//!
//! Everybody inside holds a shared lock (flock) on the root directory itself, which the kernel gives back even after
//! kill -9. Who comes or goes tries for the exclusive lock: with it, nobody else is inside, and everything found is a
//! leftover. Two who leave at once give up their shared locks one after the other, so the later one gets it.
use std::fs::File;
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::time::Duration;

use iceoryx2::node::NodeState;
use iceoryx2::prelude::CallbackProgression;
use rustix::fs::FlockOperation;

use super::Node;
use super::claim;
use super::config::Place;
use super::error::OpenError;

/// What a space consists of, below its root.
const OURS: [&str; 3] = ["nodes", "services", claim::DIRECTORY];

/// Where the kernel keeps shared memory.
const SHARED_MEMORY: &str = "/dev/shm";

/// Room to start with (bytes): one robot with all its publishers takes 0.6 MB.
const ROOM: u64 = 4 << 20;

/// The right to be in a space; dropped last, after everything that is in it.
#[derive(Debug)]
pub(crate) struct Residence {
    place: Place,
    lock: File,
}

impl Residence {
    pub(crate) fn enter(place: Place) -> Result<Self, OpenError> {
        let lock = open(&place)?;
        if try_alone(&lock) {
            check_ours(&place)?;
            sweep(&place).map_err(failed("clean up", &place))?;
        }
        share(&lock).map_err(failed("lock", &place))?;
        check_room(ROOM)?;
        Ok(Self { place, lock })
    }

    pub(crate) fn place(&self) -> &Place {
        &self.place
    }
}

/// Whoever was killed is inside until the last of its threads is gone: who leaves because of that death would else find
/// it still there, and nobody would clean up.
const TRIES: u32 = 20;
const PAUSE: Duration = Duration::from_millis(2);

impl Drop for Residence {
    fn drop(&mut self) {
        for _ in 0..TRIES {
            if try_alone(&self.lock) {
                // What cannot be removed now will be at the next start, which reports it.
                let _ = sweep(&self.place);
                return;
            }
            std::thread::sleep(PAUSE);
        }
    }
}

fn open(place: &Place) -> Result<File, OpenError> {
    File::open(place.root()).map_err(failed("open", place))
}

fn failed(action: &'static str, place: &Place) -> impl Fn(io::Error) -> OpenError {
    let path = place.root().to_owned();
    move |source| OpenError::System {
        action,
        path: path.clone(),
        source,
    }
}

fn try_alone(lock: &File) -> bool {
    rustix::fs::flock(lock, FlockOperation::NonBlockingLockExclusive).is_ok()
}

/// Waits for as long as somebody else is cleaning up. From exclusive to shared the kernel lets go for a moment: who comes
/// in between finds the space as empty as it was left.
fn share(lock: &File) -> io::Result<()> {
    Ok(rustix::io::retry_on_intr(|| {
        rustix::fs::flock(lock, FlockOperation::LockShared)
    })?)
}

fn check_room(wanted: u64) -> Result<(), OpenError> {
    let memory = rustix::fs::statvfs(SHARED_MEMORY).map_err(|error| OpenError::System {
        action: "look at",
        path: SHARED_MEMORY.into(),
        source: error.into(),
    })?;
    let free = memory.f_bavail.saturating_mul(memory.f_frsize);
    if free < wanted {
        Err(OpenError::NoRoom { free, wanted })
    } else {
        Ok(())
    }
}

fn check_ours(place: &Place) -> Result<(), OpenError> {
    let foreign = entries(place.root())
        .map_err(failed("list", place))?
        .into_iter()
        .find(|entry| !OURS.iter().any(|ours| entry == ours));
    foreign.map_or(Ok(()), |entry| {
        let entry = entry.to_string_lossy().into_owned();
        Err(OpenError::NotOurs {
            root: place.root().into(),
            entry,
        })
    })
}

/// Removes everything, unless a program that does not know of the lock is alive in the space.
fn sweep(place: &Place) -> io::Result<()> {
    if is_inhabited(place) {
        return Ok(());
    }
    for directory in OURS {
        if_there(std::fs::remove_dir_all(place.root().join(directory)))?;
    }
    for segment in entries(Path::new(SHARED_MEMORY))? {
        if segment.as_bytes().starts_with(place.prefix().as_bytes()) {
            if_there(std::fs::remove_file(Path::new(SHARED_MEMORY).join(segment)))?;
        }
    }
    Ok(())
}

fn is_inhabited(place: &Place) -> bool {
    let mut inhabited = false;
    let listed = Node::list(place.config(), |node| {
        inhabited |= matches!(node, NodeState::Alive(_) | NodeState::Inaccessible(_));
        CallbackProgression::Continue
    });
    inhabited && listed.is_ok()
}

fn entries(directory: &Path) -> io::Result<Vec<std::ffi::OsString>> {
    std::fs::read_dir(directory)?
        .map(|entry| entry.map(|entry| entry.file_name()))
        .collect()
}

fn if_there(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_little_room_is_refused_with_the_figures() {
        assert!(check_room(0).is_ok());
        let refusal = check_room(u64::MAX).unwrap_err();
        assert!(matches!(refusal, OpenError::NoRoom { free, wanted: u64::MAX } if free > 0));
    }
}
