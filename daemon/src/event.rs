//! What the real-time thread tells the telemetry thread: small values through a ring that neither waits for the other.

use std::sync::atomic::{AtomicU64, Ordering};

use coloc_estimator::{Belief, Stamp};
use coloc_shm_types::{BusState, Health, Input, Reject};
use crossbeam::queue::ArrayQueue;

use crate::ledger::Ledger;
use crate::record::Record;

/// Something that happened on the real-time thread.
#[derive(Debug)]
pub enum Event {
    /// A sensor's health changed.
    Health {
        /// Which sensor.
        input: Input,
        /// Before.
        from: Health,
        /// Since this tick.
        to: Health,
        /// Ticks since the start.
        tick: u64,
    },
    /// The worst bus changed its state.
    Bus {
        /// Before.
        from: BusState,
        /// Since this tick.
        to: BusState,
    },
    /// An input changed nothing.
    Rejected {
        /// Of which kind.
        input: Input,
        /// Why.
        reason: Reject,
    },
    /// Deadlines passed without a tick.
    Missed {
        /// How many.
        deadlines: u64,
        /// How late the tick after them woke \[ns\].
        lateness_ns: u64,
    },
    /// A clock was stepped.
    ClockStepped {
        /// How far the configured clock moved \[ns\]; zero if only the clock of the frame stamps did.
        shift_ns: i64,
    },
    /// The estimator had no room: so many messages or early foldings.
    NoRoom {
        /// Outgoing poses and reports that did not fit.
        overflowed: u32,
        /// History entries that were folded before their time.
        folded_early: u32,
    },
    /// What the robot believes, for the state file.
    Belief {
        /// When, by the configured clock.
        stamp: Stamp,
        /// When, by `CLOCK_REALTIME` \[ns\].
        realtime_ns: i64,
        /// What.
        belief: Belief,
    },
    /// A line of the recording.
    Recorded(Record),
    /// A second's account; the box comes back through [`Link::spare`].
    Account(Box<Ledger>),
}

/// The only thing that the two threads share.
#[derive(Debug)]
pub struct Link {
    /// To telemetry; full means dropped and counted.
    pub events: ArrayQueue<Event>,
    /// Empty ledgers on their way back.
    pub spare: ArrayQueue<Box<Ledger>>,
    /// Ticks since the start.
    heartbeat: AtomicU64,
}

const CAPACITY: usize = 1024;

impl Link {
    /// An empty link with one spare ledger.
    #[must_use]
    pub fn new() -> Self {
        let spare = ArrayQueue::new(2);
        // The queue is new: there is room.
        let _ = spare.push(Box::default());
        Self {
            events: ArrayQueue::new(CAPACITY),
            spare,
            heartbeat: AtomicU64::new(0),
        }
    }

    /// Says that the real-time thread has finished `tick`.
    pub fn beat(&self, tick: u64) {
        self.heartbeat.store(tick, Ordering::Relaxed);
    }

    /// The last tick that was finished.
    #[must_use]
    pub fn last_beat(&self) -> u64 {
        self.heartbeat.load(Ordering::Relaxed)
    }
}

impl Default for Link {
    fn default() -> Self {
        Self::new()
    }
}
