//! How much of a processor the porter may need as a real-time thread.
//!
//! What a ring costs is up to who is rung for: each who watches the other end is woken. So the porter is one for as long as that is
//! little, and like any other thread from then on.
#![expect(
    unsafe_code,
    reason = "no safe wrapper of these calls is among the dependencies"
)]

use std::io;
use std::os::unix::thread::JoinHandleExt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

/// In each [`SPAN`]. 32 readers at 50 Hz and somebody who knocks without end take a third of it.
const ALLOWED: Duration = Duration::from_millis(50);
const SPAN: Duration = Duration::from_secs(1);

/// Makes `thread` a real-time thread.
pub(super) fn raise(thread: &JoinHandle<()>, priority: u8) -> io::Result<()> {
    let parameters = libc::sched_param {
        sched_priority: priority.into(),
    };
    let thread = thread.as_pthread_t();
    // SAFETY: it was not joined, so it is one; the parameters live as long as the call.
    let error =
        unsafe { libc::pthread_setschedparam(thread, libc::SCHED_FIFO, &raw const parameters) };
    match error {
        0 => Ok(()),
        error => Err(io::Error::from_raw_os_error(error)),
    }
}

/// Makes the calling thread an ordinary one, which is never refused.
fn lower() {
    let parameters = libc::sched_param { sched_priority: 0 };
    // SAFETY: the parameters live as long as the call; 0 is the calling thread.
    unsafe { libc::sched_setscheduler(0, libc::SCHED_OTHER, &raw const parameters) };
}

/// That of the calling thread.
pub(super) struct Allowance {
    span: Span,
}

/// Of which at most so much may be used.
struct Span {
    from: Instant,
    /// By the thread's clock.
    used_at_start: Duration,
}

impl Allowance {
    pub(super) fn new() -> Self {
        Self {
            span: Span {
                from: Instant::now(),
                used_at_start: Duration::ZERO,
            },
        }
    }

    /// Whoever took more is urgent no more.
    pub(super) fn keep_to(&mut self, is_urgent: &AtomicBool) {
        if !is_urgent.load(Ordering::Relaxed) {
            return;
        }
        if self.span.is_exceeded(Instant::now(), used()) {
            lower();
            is_urgent.store(false, Ordering::Relaxed);
        }
    }

    /// What no reader makes longer, and has a limit of its own.
    pub(super) fn excuse(&mut self, spent: Duration) {
        self.span.used_at_start += spent;
    }
}

impl Span {
    fn is_exceeded(&mut self, now: Instant, used: Duration) -> bool {
        let is_exceeded = used.saturating_sub(self.used_at_start) > ALLOWED;
        if now.saturating_duration_since(self.from) >= SPAN {
            *self = Self {
                from: now,
                used_at_start: used,
            };
        }
        is_exceeded
    }
}

/// The processor's time that the calling thread has had.
fn used() -> Duration {
    let used = clock_gettime(ClockId::ThreadCPUTime);
    Duration::try_from(used).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    fn policy() -> i32 {
        // SAFETY: 0 is the calling thread.
        unsafe { libc::sched_getscheduler(0) }
    }

    /// Ordinary again once it has used more than it may.
    #[test]
    fn who_needs_much_is_not_urgent_any_more() {
        let (raised, is_raised) = channel::<bool>();
        let is_urgent = AtomicBool::new(true);
        let mut allowance = Allowance::new();
        let thread = std::thread::spawn(move || {
            if !is_raised.recv().unwrap() {
                return;
            }
            allowance.keep_to(&is_urgent);
            assert_eq!(policy(), libc::SCHED_FIFO);
            while used() <= 2 * ALLOWED {}
            allowance.keep_to(&is_urgent);
            assert_eq!(policy(), libc::SCHED_OTHER);
            assert!(!is_urgent.load(Ordering::Relaxed));
        });
        let is_granted = raise(&thread, 1).is_ok();
        if !is_granted {
            eprintln!("SKIPPED: a real-time thread, which this user may not have");
        }
        raised.send(is_granted).unwrap();
        thread.join().unwrap();
    }

    #[test]
    fn so_much_is_allowed_in_each_span_and_what_was_not_used_is_not_saved() {
        let start = Instant::now();
        let mut span = Span {
            from: start,
            used_at_start: Duration::ZERO,
        };
        for second in 1..=10 {
            let (now, used) = (start + second * SPAN, second * ALLOWED);
            assert!(!span.is_exceeded(now, used), "{second}");
        }
        let (now, used) = (start + 20 * SPAN, 10 * ALLOWED);
        assert!(!span.is_exceeded(now, used));
        let more = used + ALLOWED + Duration::from_nanos(1);
        assert!(span.is_exceeded(now + SPAN / 2, more));
    }
}
