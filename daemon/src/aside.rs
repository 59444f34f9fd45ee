//! Work that may take its time, or never come back: a thread behind a bounded queue.
//!
//! Disks and pipes stall. Who hands work on here never waits for them: what finds the queue full is given back, and a
//! worker that does not come back when the process ends is left behind.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread::Builder;
use std::time::{Duration, Instant};

use crossbeam::channel::{Receiver, Sender, TrySendError, bounded};

/// Small, because with `realtime.lock_memory` all of it is resident.
const STACK: usize = 512 << 10;

/// The queue's end for those who have work.
#[derive(Debug)]
pub(crate) struct Aside<T> {
    queue: Sender<Job<T>>,
}

#[derive(Debug)]
enum Job<T> {
    Do(T),
    /// Everything before it is done when this is dropped.
    Mark(Sender<()>),
}

impl<T> Clone for Aside<T> {
    fn clone(&self) -> Self {
        Self {
            queue: self.queue.clone(),
        }
    }
}

impl<T: Send + 'static> Aside<T> {
    /// A thread called `name` that does `work` with one thing after the other; `capacity` of them can wait.
    ///
    /// # Errors
    /// If there is no thread to be had.
    pub(crate) fn start(
        name: &str,
        capacity: usize,
        work: impl FnMut(T) + Send + 'static,
    ) -> io::Result<Self> {
        let (queue, jobs) = bounded(capacity);
        Builder::new()
            .name(name.into())
            .stack_size(STACK)
            .spawn(move || serve(&jobs, work))?;
        Ok(Self { queue })
    }

    /// Hands on a thing to work on; never waits.
    ///
    /// # Errors
    /// Gives it back if too many are waiting.
    pub(crate) fn offer(&self, thing: T) -> Result<(), T> {
        self.queue
            .try_send(Job::Do(thing))
            .map_err(|error| match error {
                TrySendError::Full(Job::Do(thing)) | TrySendError::Disconnected(Job::Do(thing)) => {
                    thing
                }
                _ => unreachable!("what was put in comes back"),
            })
    }

    /// Waits until everything that was handed on is done, but no longer than `patience`; whether it is.
    pub(crate) fn finish(&self, patience: Duration) -> bool {
        let deadline = Instant::now() + patience;
        let (mark, done) = bounded(0);
        let queued = self.queue.send_deadline(Job::Mark(mark), deadline).is_ok();
        queued
            && done
                .recv_deadline(deadline)
                .is_err_and(|error| !error.is_timeout())
    }
}

/// A panic loses the thing that was worked on; the panic hook has said so.
fn serve<T>(jobs: &Receiver<Job<T>>, mut work: impl FnMut(T)) {
    for job in jobs {
        match job {
            Job::Do(thing) => drop(catch_unwind(AssertUnwindSafe(|| work(thing)))),
            Job::Mark(mark) => drop(mark),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    const LONG: Duration = Duration::from_secs(20);

    #[test]
    fn a_stalled_worker_holds_nobody_up() {
        let (go, stalled) = channel::<()>();
        let aside = Aside::start("stalled", 2, move |_| {
            let _ = stalled.recv();
        })
        .unwrap();
        let refused = (0..10).filter(|&n| aside.offer(n).is_err()).count();
        assert!((7..=8).contains(&refused), "{refused} of 10 found no room");
        assert!(!aside.finish(Duration::from_millis(10)));
        drop(go);
        assert!(aside.finish(LONG));
    }

    #[test]
    fn a_panic_loses_one_thing_and_not_the_worker() {
        let (done, results) = channel();
        let work = move |n: u32| done.send(100 / n).unwrap();
        let aside = Aside::start("panicking", 8, work).unwrap();
        for n in [5, 0, 2] {
            aside.offer(n).unwrap();
        }
        assert!(aside.finish(LONG));
        assert_eq!(results.try_iter().collect::<Vec<_>>(), [20, 50]);
    }
}
