//! One estimate of each robot.

use std::thread::sleep;
use std::time::{Duration, Instant};

use coloc_shm_types::{Estimate, PortError, Running};

use crate::demo::interrupt::Interrupt;
use crate::estimates::{Deaf, Estimates, Station};
use crate::place::Found;

/// An estimate is of use for as long: who says nothing in that time is silent.
const PATIENCE: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(5);

/// What was heard of a robot.
pub(super) enum Word {
    /// What it believes.
    Estimate(Box<Estimate>),
    /// It has no channel for its estimates yet.
    Starting,
    /// It said nothing.
    Silent,
    /// It could not be listened to.
    Refused(String),
}

/// An ear, until it has heard something.
enum Ear {
    Open(Estimates),
    Done(Word),
}

/// Hears all of them at once, in their order.
pub(super) fn hear(found: &Found, interrupt: &Interrupt) -> Vec<Word> {
    let place = &found.place;
    let station = match Station::enter(place, "coloc-list") {
        Ok(station) => station,
        Err(error) => return refused(found, &error.to_string()),
    };
    let mut ears: Vec<Ear> = found
        .robots
        .iter()
        .map(|robot| Ear::open(&station, robot))
        .collect();
    let deadline = Instant::now() + PATIENCE;
    while ears.iter_mut().any(Ear::waits) && Instant::now() < deadline && !interrupt.is_there() {
        sleep(PAUSE);
    }
    ears.into_iter().map(Ear::word).collect()
}

/// Who runs is known nevertheless; why nothing was heard is said once.
fn refused(found: &Found, why: &str) -> Vec<Word> {
    let silent = found.robots.iter().skip(1).map(|_| Word::Silent);
    std::iter::once(Word::Refused(why.into()))
        .chain(silent)
        .collect()
}

impl Ear {
    fn open(station: &Station, robot: &Running) -> Self {
        match station.hear_existing(&robot.robot) {
            Ok(estimates) => Self::Open(estimates),
            Err(Deaf::Port(PortError::NoChannel { .. })) => Self::Done(Word::Starting),
            Err(error) => Self::Done(Word::Refused(error.to_string())),
        }
    }

    /// Gives its place back as soon as it has heard something.
    fn waits(&mut self) -> bool {
        let Self::Open(estimates) = self else {
            return false;
        };
        let word = match estimates.receive() {
            Ok(None) => return true,
            Ok(Some(estimate)) => Word::Estimate(Box::new(estimate)),
            Err(error) => Word::Refused(error),
        };
        *self = Self::Done(word);
        false
    }

    fn word(self) -> Word {
        match self {
            Self::Open(_) => Word::Silent,
            Self::Done(word) => word,
        }
    }
}
