//! How the robot's thread calls the porter before there is an estimate, so that it is awake when there is one.
//!
//! ```text
//! robot's thread:  call ─► …    write the page ─► … ─► ring (nobody is armed) ─► settle
//! porter:            └─► awake: look, look, look ─► a byte for each reader          └─► arm ─► look ─► sleep
//! ```
//!
//! A wake-up takes longer than the rest of the way, and while half of a sample is on the wire there is time for it. All of it is in
//! this process. Who is called in vain sleeps again after [`LIMIT`]; nothing is lost, because it arms its bell before it looks again.
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rustix::event::{EventfdFlags, eventfd};
use rustix::fd::{AsFd, BorrowedFd, OwnedFd};
use rustix::io::Result;

/// As long as the porter stays awake for one estimate.
const LIMIT: Duration = Duration::from_micros(500);
/// It looks for at most one part in so many of the time, and may save as much as that for later.
const SHARE: u32 = 20;
const SAVED: Duration = LIMIT.saturating_mul(SHARE);

/// What both have of it.
#[derive(Debug)]
pub(super) struct Call {
    event: OwnedFd,
    /// The porter is asleep, and comes if it is called.
    waits: AtomicBool,
    /// It is in real time.
    pub(super) is_urgent: AtomicBool,
    /// Estimates, when it was called.
    called_at: AtomicU64,
    written: AtomicU64,
    rung: AtomicU64,
}

impl Call {
    pub(super) fn new() -> Result<Self> {
        Ok(Self {
            event: eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?,
            waits: AtomicBool::new(false),
            is_urgent: AtomicBool::new(false),
            called_at: AtomicU64::new(0),
            written: AtomicU64::new(0),
            rung: AtomicU64::new(0),
        })
    }

    /// An estimate is to be found that was not yet.
    pub(super) fn wrote(&self) {
        let written = self.written.load(Ordering::Relaxed);
        (self.written).store(written.wrapping_add(1), Ordering::Release);
    }

    /// Who waits for it was rung for, if nobody else did.
    pub(super) fn settle(&self) {
        let written = self.written.load(Ordering::Relaxed);
        self.rung.store(written, Ordering::Release);
    }

    /// A system call, if the porter is asleep and somebody waits: once for each time that it goes to sleep.
    pub(super) fn call(&self) {
        if self.waits.load(Ordering::Relaxed) && self.waits.swap(false, Ordering::Acquire) {
            let written = self.written.load(Ordering::Relaxed);
            self.called_at.store(written, Ordering::Release);
            // The counter has room: it is read before the porter waits again.
            let _ = rustix::io::write(&self.event, &1_u64.to_ne_bytes());
        }
    }
}

impl AsFd for Call {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.event.as_fd()
    }
}

/// What the porter has of it.
pub(super) struct Watch {
    /// Time that it may look for.
    saved: Cell<Duration>,
    counted: Cell<Instant>,
}

impl Watch {
    pub(super) fn new() -> Self {
        Self {
            saved: Cell::new(SAVED),
            counted: Cell::new(Instant::now()),
        }
    }

    /// Before a sleep; whether somebody would be rung for.
    pub(super) fn goes_to_sleep(&self, call: &Call, somebody_waits: bool) {
        let now = Instant::now();
        let earned = now.saturating_duration_since(self.counted.replace(now)) / SHARE;
        self.saved.set((self.saved.get() + earned).min(SAVED));
        let comes =
            somebody_waits && self.saved.get() >= LIMIT && call.is_urgent.load(Ordering::Relaxed);
        call.waits.store(comes, Ordering::Release);
    }

    /// Looks until there is an estimate, does `pass_on`, and waits until its robot has rung; or until it has been long enough. How
    /// many estimates it has seen, and for how long it has looked.
    pub(super) fn attend(&self, call: &Call, pass_on: impl FnOnce()) -> (u64, Duration) {
        let _ = rustix::io::read(&call.event, &mut [0; 8]);
        let known = call.called_at.load(Ordering::Acquire);
        let start = Instant::now();
        let until = |is_over: &dyn Fn() -> bool| {
            while !is_over() && start.elapsed() < LIMIT {
                std::hint::spin_loop();
            }
        };
        until(&|| call.written.load(Ordering::Acquire) != known);
        let written = call.written.load(Ordering::Acquire);
        if written != known {
            pass_on();
            until(&|| call.rung.load(Ordering::Acquire) == call.written.load(Ordering::Relaxed));
        }
        let took = start.elapsed();
        self.saved.set(self.saved.get().saturating_sub(took));
        (written, took)
    }

    /// After the bell was armed: whether there are more estimates than were `seen`.
    pub(super) fn has_missed(call: &Call, seen: u64) -> bool {
        call.written.load(Ordering::Acquire) != seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_called(call: &Call) -> bool {
        rustix::io::read(&call.event, &mut [0; 8]).is_ok()
    }

    fn asleep(is_urgent: bool) -> (Call, Watch) {
        let (call, watch) = (Call::new().unwrap(), Watch::new());
        call.is_urgent.store(is_urgent, Ordering::Relaxed);
        watch.goes_to_sleep(&call, true);
        (call, watch)
    }

    #[test]
    fn it_is_called_once_in_a_sleep_and_only_if_somebody_waits() {
        let (call, watch) = asleep(true);
        call.call();
        assert!(is_called(&call));
        call.call();
        assert!(!is_called(&call));
        watch.goes_to_sleep(&call, false);
        call.call();
        assert!(!is_called(&call));
        let (call, _) = asleep(false);
        call.call();
        assert!(!is_called(&call), "it is not in real time");
    }

    #[test]
    fn what_was_written_since_the_call_is_passed_on_and_what_came_later_is_seen() {
        let (call, watch) = asleep(true);
        call.wrote();
        call.settle();
        call.call();
        call.wrote();
        call.settle();
        let mut passed_on = 0;
        let (seen, _) = watch.attend(&call, || passed_on += 1);
        assert_eq!((seen, passed_on), (2, 1));
        assert!(!Watch::has_missed(&call, seen));
        call.wrote();
        assert!(Watch::has_missed(&call, seen));
    }

    #[test]
    fn who_is_called_in_vain_comes_back_and_not_without_end() {
        let (call, watch) = asleep(true);
        let mut calls = 0;
        loop {
            call.call();
            if !is_called(&call) {
                break;
            }
            calls += 1;
            let (seen, took) = watch.attend(&call, || unreachable!("there is nothing"));
            assert!(seen == 0 && took >= LIMIT);
            // As if no time had passed.
            watch.counted.set(Instant::now() + SAVED);
            watch.goes_to_sleep(&call, true);
        }
        assert!((1..=SHARE).contains(&calls), "{calls}");
    }
}
