//! Every way a CAN bus goes wrong: how it is made, what health must say at which tick, what the estimate may do.
//!
//! One table drives the tests and fills in `tests/hil/README.md`.

mod markdown;
mod play;
mod script;
mod suite;
mod table;

use coloc_shm_types::{BusState, CanCounters, Health};

pub use markdown::filled_in;
pub use play::play;
pub use script::Script;
pub use suite::play_all;
pub use table::FAULTS;

/// A fault, and what is expected under it. Ticks are counted from 1, the first that the fault reaches.
pub struct Fault {
    /// What goes wrong.
    pub name: &'static str,
    /// In the field's word.
    pub word: Word,
    /// How the tests make it.
    pub made: &'static str,
    /// Where it can be made.
    pub place: Place,
    /// How long it lasts.
    pub ticks: u32,
    /// The encoders' first count.
    pub first_ticks: u32,
    /// What happens before each tick of it.
    pub script: Script,
    /// When odometry's health changes, and to what; it begins and ends as `Ok`.
    pub health: &'static [(u32, Health)],
    /// When the state of the bus changes; it begins and ends as `Active`.
    pub bus: &'static [(u32, BusState)],
    /// What the status counts, and how much of it; everything else it does not count.
    pub counts: &'static [Count],
    /// What becomes of the estimate.
    pub estimate: Way,
    /// The good tick, counted from the end of the fault, from which everything is well again.
    pub again: u32,
}

/// The field's words for what a sensor does wrong.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Word {
    /// Nothing comes.
    Off,
    /// The same comes again.
    Stuck,
    /// What comes means nothing.
    Garbage,
    /// What comes is well formed and not true.
    Wrong,
    /// Less comes than should.
    Slow,
    /// It comes late.
    Delayed,
    /// It comes and goes.
    Intermittent,
}

/// Where a fault can be made.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// On any bus.
    Anywhere,
    /// Where an error frame can be sent: on anything but hardware, which makes its own.
    NoHardware,
    /// On an interface, virtual or not.
    Interface,
    /// On an interface that can be taken away: hardware cannot.
    Virtual,
}

/// A counter of the status.
pub struct Count {
    /// Its name there.
    pub name: &'static str,
    /// Where it is.
    pub of: fn(&CanCounters) -> u64,
    /// By how much it grows in all.
    pub by: u64,
    /// At least.
    pub or_more: bool,
}

impl Count {
    const fn or_more(self) -> Self {
        Self {
            or_more: true,
            ..self
        }
    }
}

/// What the estimate may do. Whatever it is: every number published is finite, every covariance a covariance.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Way {
    /// The truth stays within 3σ, and after recovery nothing of the way is missing.
    Kept,
    /// It turns as the false wheel says, by so much \[rad\]: nothing on the bus can tell. Fixes and neighbours can.
    Turns(f64),
}

/// What a list of changes says about `tick`.
fn at<T: Copy>(changes: &[(u32, T)], tick: u32, before: T) -> T {
    let past = changes.iter().take_while(|change| change.0 <= tick);
    past.last().map_or(before, |change| change.1)
}

impl std::fmt::Display for Word {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Off => "off",
            Self::Stuck => "stuck",
            Self::Garbage => "garbage",
            Self::Wrong => "wrong",
            Self::Slow => "slow",
            Self::Delayed => "delayed",
            Self::Intermittent => "intermittent",
        })
    }
}
