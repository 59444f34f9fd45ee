//! A thread whose end is noticed however it ends, and waited for only so long.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::{Builder, Result};
use std::time::Instant;

/// A running thread.
pub(super) struct Watched<T> {
    ended: Receiver<Result<T>>,
}

/// How a thread ended.
#[derive(Debug, PartialEq)]
pub(super) enum Ending<T> {
    /// With this.
    Returned(T),
    /// The panic hook has said why.
    Panicked,
    /// Not yet.
    Stuck,
}

impl<T: Send + 'static> Watched<T> {
    /// Starts `body`, and calls `at_end` when it is over and has dropped everything, also by a panic.
    pub(super) fn start(
        builder: Builder,
        body: impl FnOnce() -> T + Send + 'static,
        at_end: impl FnOnce() + Send + 'static,
    ) -> io::Result<Self> {
        let (end, ended) = channel();
        builder.spawn(move || {
            let result = catch_unwind(AssertUnwindSafe(body));
            // Nobody listens any more who has given up on this thread.
            let _ = end.send(result);
            at_end();
        })?;
        Ok(Self { ended })
    }

    /// Waits for the end, no longer than to `deadline`.
    pub(super) fn join_until(self, deadline: Instant) -> Ending<T> {
        let left = deadline.saturating_duration_since(Instant::now());
        match self.ended.recv_timeout(left) {
            Ok(Ok(result)) => Ending::Returned(result),
            Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => Ending::Panicked,
            Err(RecvTimeoutError::Timeout) => Ending::Stuck,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn run<T: PartialEq + Send + 'static>(
        body: impl FnOnce() -> T + Send + 'static,
        patience: Duration,
    ) -> (Ending<T>, bool) {
        let (told, end) = channel();
        let at_end = move || told.send(()).unwrap();
        let thread = Watched::start(Builder::new(), body, at_end).unwrap();
        let ending = thread.join_until(Instant::now() + patience);
        let was_told = ending != Ending::Stuck && end.recv().is_ok();
        (ending, was_told)
    }

    const LONG: Duration = Duration::from_secs(20);

    #[test]
    fn an_end_is_told_however_it_comes() {
        assert_eq!(run(|| 7, LONG), (Ending::Returned(7), true));
        assert_eq!(
            run(|| panic!("on purpose"), LONG),
            (Ending::<()>::Panicked, true)
        );
    }

    #[test]
    fn what_was_held_is_dropped_before_the_end_is_told() {
        let (held, dropped) = channel::<()>();
        run(
            move || {
                let _held = held;
                panic!("on purpose")
            },
            LONG,
        );
        assert_eq!(
            dropped.try_recv(),
            Err(std::sync::mpsc::TryRecvError::Disconnected)
        );
    }

    #[test]
    fn who_does_not_come_back_is_left_behind() {
        let (go, stuck) = channel::<()>();
        let (ending, _) = run(move || stuck.recv().is_ok(), Duration::from_millis(10));
        assert_eq!(ending, Ending::Stuck);
        drop(go);
    }
}
