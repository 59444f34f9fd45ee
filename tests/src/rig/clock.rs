//! A clock that runs, and steps, when it is told to.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use coloc_daemon::clock::{Reading, TimeSource};

/// The rig's clock; clones are the same clock.
///
/// It is nowhere near the kernel's: a frame's own stamp is then implausible to the daemon, which takes the time of the
/// read instead. So every frame has the stamp of the tick that it was sent for, and every run is the same run.
#[derive(Clone, Debug)]
pub struct Clock(Arc<Times>);

#[derive(Debug)]
struct Times {
    monotonic_ns: AtomicI64,
    realtime_ns: AtomicI64,
}

const START_NS: i64 = 1_000_000_000_000;

impl Default for Clock {
    fn default() -> Self {
        Self(Arc::new(Times {
            monotonic_ns: AtomicI64::new(START_NS),
            realtime_ns: AtomicI64::new(2 * START_NS),
        }))
    }
}

impl Clock {
    /// Time passes.
    pub fn run(&self, ns: i64) {
        self.0.monotonic_ns.fetch_add(ns, Ordering::Relaxed);
        self.step(ns);
    }

    /// Somebody sets the clock of the day.
    pub fn step(&self, ns: i64) {
        self.0.realtime_ns.fetch_add(ns, Ordering::Relaxed);
    }
}

impl TimeSource for Clock {
    fn read(&self) -> Reading {
        let realtime_ns = self.0.realtime_ns.load(Ordering::Relaxed);
        Reading {
            monotonic_ns: self.0.monotonic_ns.load(Ordering::Relaxed),
            realtime_ns,
            tai_ns: realtime_ns,
        }
    }
}
