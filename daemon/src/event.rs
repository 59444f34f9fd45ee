//! What the real-time thread tells the telemetry thread: small values through a ring.
//!
//! Lock-free is not enough: who takes from crossbeam's queue has the place before its value is out, and who comes to that very
//! place meanwhile spins. If the real-time thread had preempted the telemetry thread right there, it would spin for as long as
//! it keeps it from running. So it never comes to that place: a place is always left free between them, and what
//! comes back to it does so by one exchange of a pointer.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};

use coloc_drivers::canopen::CanopenEvent;
use coloc_drivers::encoder::Slip;
use coloc_estimator::assist::news::News;
use coloc_estimator::{Belief, Decision};
use coloc_shm_types::{
    BeliefState, BusState, Health, Input, Opinion, Reject, SourceState, Timing, WhyUnfit,
};
use crossbeam::atomic::AtomicCell;
use crossbeam::queue::ArrayQueue;

use crate::account::Ledger;
use crate::clock::ClockStep;
use crate::hearing::Hearing;
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
    /// Whether the robot knows where it is has changed.
    State {
        /// Before.
        from: BeliefState,
        /// Since this tick.
        to: BeliefState,
        /// Its wheels alone are missing.
        waits_for_wheels: bool,
        /// Ticks since the start.
        tick: u64,
    },
    /// Whether the robot may drive on its belief has changed, or why not.
    Fitness {
        /// Why not; none: it may.
        why_unfit: Option<WhyUnfit>,
        /// Ticks since the start.
        tick: u64,
    },
    /// What a second opinion says of the belief has changed.
    Opinion {
        /// Before.
        from: Opinion,
        /// Since this tick.
        to: Opinion,
        /// Ticks since the start.
        tick: u64,
    },
    /// A source begins to stand against the belief, or no longer does.
    Dissent {
        /// Of which kind.
        input: Input,
        /// Which sensor or robot.
        source: u16,
        /// By how much; none: it no longer does.
        against: Option<Against>,
    },
    /// Something was decided about where the robot is.
    Decided {
        /// For a source of this kind.
        input: Input,
        /// Which sensor or robot.
        source: u16,
        /// What.
        decision: Decision,
        /// How long before the tick the word came that it rests on \[ns\].
        ago_ns: i64,
    },
    /// What is known of the gyro has changed.
    Gyro {
        /// What.
        news: GyroNews,
        /// \[rad/s\]
        bias: f64,
        /// Standard deviation of it \[rad/s\].
        sigma: f64,
    },
    /// The worst bus changed its state.
    Bus {
        /// Before.
        from: BusState,
        /// Since this tick.
        to: BusState,
    },
    /// Wheels do not fit one another, or do again.
    Slips(Option<Slip>),
    /// A CANopen node, or who sends SYNC.
    Canopen(CanopenEvent),
    /// Of leaders and children.
    Assist(News),
    /// An input changed nothing.
    Rejected {
        /// Of which kind.
        input: Input,
        /// Which sensor or robot.
        source: u16,
        /// Why.
        reason: Reject,
        /// By how much, if it met a gate.
        gated: Option<Gated>,
    },
    /// Several senders claim one source, or no longer.
    Contested {
        /// On which channel.
        input: Input,
        /// The source, and how many live.
        state: SourceState,
    },
    /// Deadlines passed without a tick.
    Missed {
        /// How many.
        deadlines: u64,
        /// How late the tick after them woke \[ns\].
        lateness_ns: u64,
    },
    /// Somebody set a wall clock.
    ClockStepped(ClockStep),
    /// The estimator had no room: so many messages or early foldings.
    NoRoom {
        /// Outgoing poses and reports that did not fit.
        overflowed: u32,
        /// History entries that were folded before their time.
        folded_early: u32,
    },
    /// What the robot believes, for the state file.
    Belief {
        /// When, by `CLOCK_BOOTTIME` \[ns\].
        boot_ns: i64,
        /// What.
        belief: Belief,
        /// `[v_x, v_y, ω]`, if there is odometry \[m/s, m/s, rad/s\].
        velocity: Option<[f64; 3]>,
        /// Bias of the gyro and its variance, if there is one \[rad/s, rad²/s²\].
        gyro: Option<[f64; 2]>,
    },
    /// Events that found no room in the ring; telemetry's own, from the account.
    Lost {
        /// How many.
        events: u64,
    },
    /// Where the time of a tick went, to be published.
    Timing(Timing),
    /// A line of the recording.
    Recorded(Record),
    /// A second's account; the box comes back through [`Link::give_back`].
    Account(Box<Ledger>),
}

/// What there is to say of a gyro.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum GyroNews {
    /// Its bias is known.
    Known,
    /// Gyro and wheels say different things.
    Slips,
    /// They agree again.
    Holds {
        /// How long they did not \[ns\].
        after_ns: i64,
    },
    /// Single samples part from all around them.
    Wild {
        /// How many, since the start.
        count: u32,
    },
}

/// How a source stands against the belief.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Against {
    /// For how long \[ns\].
    pub for_ns: i64,
    /// How far away it has the robot \[m\]; NaN: it does not say yet.
    pub distance_m: f64,
    /// d² of its last word.
    pub d2: f64,
}

/// How far a measurement was off that met a gate.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Gated {
    /// Normalised innovation squared.
    pub d2: f64,
    /// Beyond it is refused.
    pub gate: f64,
}

/// The only thing that the two threads share.
pub struct Link {
    events: ArrayQueue<Event>,
    /// An empty ledger on its way back.
    spare: AtomicCell<Option<Box<Ledger>>>,
    /// Ticks since the start.
    heartbeat: AtomicU64,
    /// What is heard of the wheels.
    pub hearing: Hearing,
}

/// There was no room in the ring.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Full;

impl Link {
    /// So many events fit.
    pub const CAPACITY: usize = 1024;

    /// An empty link with one spare ledger.
    #[must_use]
    pub fn new() -> Self {
        // A box or none is a pointer: exchanging it takes no lock.
        const { assert!(AtomicCell::<Option<Box<Ledger>>>::is_lock_free()) };
        Self {
            // One that is being taken, and one that separates the threads.
            events: ArrayQueue::new(Self::CAPACITY + 2),
            spare: AtomicCell::new(Some(Box::default())),
            heartbeat: AtomicU64::new(0),
            hearing: Hearing::new(),
        }
    }

    /// To telemetry, from the real-time thread alone.
    ///
    /// # Errors
    /// There is no room: the event is dropped.
    pub fn tell(&self, event: Event) -> Result<(), Full> {
        if self.is_full() {
            return Err(Full);
        }
        // There is room, as nobody else puts anything in.
        self.events.push(event).map_err(|_| Full)
    }

    /// Whether telemetry has more to catch up with than fits.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.events.len() >= Self::CAPACITY
    }

    /// Whether what matters least should give way to what may come.
    #[must_use]
    pub fn is_half_full(&self) -> bool {
        self.events.len() >= Self::CAPACITY / 2
    }

    /// The next event, for the telemetry thread alone.
    #[must_use]
    pub fn next_event(&self) -> Option<Event> {
        self.events.pop()
    }

    /// How many events telemetry has still to take.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.events.len()
    }

    /// From telemetry: a ledger, emptied, for the real-time thread to fill.
    pub fn give_back(&self, ledger: Box<Ledger>) {
        self.spare.store(Some(ledger));
    }

    /// To the real-time thread: an empty ledger, if one has come back.
    #[must_use]
    pub fn take_spare(&self) -> Option<Box<Ledger>> {
        self.spare.take()
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

impl fmt::Debug for Link {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Link")
            .field("waiting", &self.waiting())
            .field("heartbeat", &self.last_beat())
            .finish_non_exhaustive()
    }
}

impl Default for Link {
    fn default() -> Self {
        Self::new()
    }
}
