//! Services are made, opened, left and removed by one process at a time.
//!
//! iceoryx2 removes a service in steps, by the names of its files. Whoever makes it anew between two of them loses the new
//! files to the old steps: some then use a service that nobody else can find. Its cleaning up after the dead takes a
//! service that is just being made for a broken one, too. So whoever does any of it holds a lock that the kernel gives back.
use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::lock;
use crate::private::OwnFile;

/// A pass takes milliseconds; who holds it for longer is stopped, and is not waited for again until it goes on.
const PATIENCE: Duration = Duration::from_millis(400);
/// The end of a process has less time.
const PATIENCE_OF_THE_LEAVING: Duration = Duration::from_millis(50);
const PAUSE: Duration = Duration::from_micros(200);

#[derive(Debug)]
pub(crate) struct Gate {
    /// There is a key for as long as somebody is in the space.
    key: OwnFile,
    is_stuck: AtomicBool,
}

/// The turn of one; over when it is dropped.
#[derive(Debug)]
pub(crate) struct Pass(Option<File>);

impl Pass {
    /// Not if whoever has the turn is stopped, or if the key is gone: then it is done all the same, as nobody may be locked
    /// out.
    pub(crate) fn is_alone(&self) -> bool {
        self.0.is_some()
    }
}

impl Gate {
    pub(super) fn new(key: OwnFile) -> Self {
        Self {
            key,
            is_stuck: AtomicBool::new(false),
        }
    }

    pub(crate) fn pass(&self) -> Pass {
        self.wait(PATIENCE)
    }

    pub(crate) fn leave(&self) -> Pass {
        self.wait(PATIENCE_OF_THE_LEAVING)
    }

    /// For what can be done another time.
    pub(crate) fn pass_at_once(&self) -> Option<Pass> {
        let file = self.key.existing().ok()??;
        lock::try_alone(&file).then_some(Pass(Some(file)))
    }

    fn wait(&self, patience: Duration) -> Pass {
        // What is wrong with the key is told by the space's next check.
        let Ok(Some(file)) = self.key.existing() else {
            return Pass(None);
        };
        let deadline = Instant::now() + patience;
        while !lock::try_alone(&file) {
            if self.is_stuck.load(Ordering::Relaxed) || Instant::now() > deadline {
                self.is_stuck.store(true, Ordering::Relaxed);
                return Pass(None);
            }
            std::thread::sleep(PAUSE);
        }
        self.is_stuck.store(false, Ordering::Relaxed);
        Pass(Some(file))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate(directory: &tempfile::TempDir) -> Gate {
        Gate::new(OwnFile::named(&directory.path().join("key")).unwrap())
    }

    #[test]
    fn one_passes_at_a_time_also_of_the_same_process() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("key"), "").unwrap();
        let (here, there) = (gate(&directory), gate(&directory));
        let pass = here.pass();
        assert!(pass.is_alone());
        assert!(here.pass_at_once().is_none() && there.pass_at_once().is_none());
        drop(pass);
        assert!(there.pass_at_once().is_some());
    }

    #[test]
    fn who_is_stopped_is_waited_for_once() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("key"), "").unwrap();
        let (stopped, other) = (gate(&directory), gate(&directory));
        let pass = stopped.pass();
        assert!(!other.pass().is_alone() && other.is_stuck.load(Ordering::Relaxed));
        assert!(!other.pass().is_alone());
        drop(pass);
        assert!(other.pass().is_alone() && !other.is_stuck.load(Ordering::Relaxed));
    }

    #[test]
    fn without_a_key_nobody_waits() {
        let directory = tempfile::tempdir().unwrap();
        assert!(!gate(&directory).pass().is_alone());
    }
}
