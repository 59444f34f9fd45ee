//! A clock that runs, and steps, when it is told to.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use coloc_daemon::clock::{KernelTime, Reading, TimeSource};

use super::PERIOD_NS;

/// The rig's clock; clones are the same clock.
///
/// It is nowhere near the kernel's, which stamps the frames. What the daemon gets to see of these stamps is [`Stamps`]; either
/// way a frame has the stamp of the tick that it was sent for, and every run is the same run.
#[derive(Clone, Debug)]
pub struct Clock(Arc<Mutex<Times>>);

/// What the daemon sees of the kernel's frame stamps.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Stamps {
    /// What a kernel would have written that lives by the rig's clock of the day.
    Plausible,
    /// What this machine's kernel wrote, which cannot be true: the daemon takes the time of the read instead.
    Unbelievable,
    /// Two frames a period, whenever they are read: time is told by counting them.
    Counted,
}

#[derive(Debug)]
struct Times {
    stamps: Stamps,
    boot_ns: i64,
    realtime_ns: i64,
    /// Frames that were read.
    frames: i64,
    /// Since when by the kernel's clock the rig's says what it says: the newest last.
    marks: Vec<Mark>,
}

#[derive(Copy, Clone, Debug)]
struct Mark {
    kernel_ns: i64,
    realtime_ns: i64,
}

const START_NS: i64 = 1_000_000_000_000;

/// Frames of so many ticks may be on their way.
const MARKS: usize = 256;

impl Clock {
    /// A clock at its beginning.
    #[must_use]
    pub fn new(stamps: Stamps) -> Self {
        let clock = Self(Arc::new(Mutex::new(Times {
            stamps,
            boot_ns: START_NS,
            realtime_ns: match stamps {
                Stamps::Plausible | Stamps::Unbelievable => 2 * START_NS,
                Stamps::Counted => START_NS,
            },
            frames: 0,
            marks: Vec::with_capacity(2 * MARKS),
        })));
        clock.times().mark();
        clock
    }

    /// Time passes.
    pub fn run(&self, ns: i64) {
        let mut times = self.times();
        times.boot_ns += ns;
        times.realtime_ns += ns;
        times.mark();
    }

    /// Somebody sets the clock of the day.
    pub fn step(&self, ns: i64) {
        let mut times = self.times();
        times.realtime_ns += ns;
        times.mark();
    }

    fn times(&self) -> MutexGuard<'_, Times> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Times {
    fn mark(&mut self) {
        if self.marks.len() == self.marks.capacity() {
            self.marks.drain(..MARKS);
        }
        self.marks.push(Mark {
            kernel_ns: KernelTime.read().realtime_ns,
            realtime_ns: self.realtime_ns,
        });
    }

    /// One more frame: it came with the pair that it is of, and that is now.
    fn count(&mut self) -> i64 {
        let pair_ns = START_NS + PERIOD_NS * (self.frames / 2);
        self.frames += 1;
        (self.boot_ns, self.realtime_ns) = (pair_ns, pair_ns);
        pair_ns
    }

    /// The rig's clock of the day at the tick that a frame was sent for.
    fn stamp(&self, kernel_ns: i64) -> i64 {
        let mark = self.marks.iter().rev().find(|it| it.kernel_ns <= kernel_ns);
        mark.map_or(kernel_ns, |mark| mark.realtime_ns + PERIOD_NS)
    }
}

impl TimeSource for Clock {
    fn read(&self) -> Reading {
        let times = self.times();
        Reading {
            boot_ns: times.boot_ns,
            realtime_ns: times.realtime_ns,
            tai_ns: times.realtime_ns,
            width_ns: 0,
        }
    }

    fn of_kernel(&self, stamp_ns: i64) -> i64 {
        let mut times = self.times();
        match times.stamps {
            Stamps::Plausible => times.stamp(stamp_ns),
            Stamps::Unbelievable => stamp_ns,
            Stamps::Counted => times.count(),
        }
    }
}
