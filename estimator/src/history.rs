//! The fixed-capacity history of beliefs, odometry and measurements.
//!
//! # Model
//!
//! Measurements lie in the order of their stamps; equal stamps form one event, ordered as Algorithm 4 handles it:
//! odometry, own sightings, questions, neighbours' words, answers, landmarks, headings, fixes, poses that a person or a map says, then by source, session and sequence. Each entry keeps the belief
//! after it. What lies before the oldest entry is the *base*: a stamp and the belief then.
//!
//! Between two entries the belief is propagated leg by leg. At each moment t the first sample in the order that
//! covers it (start < t ≤ stamp) gives the velocity. Where none does, the last sample that has ended is held, its
//! noise growing, for the hold time; from then on the robot is taken as standing still, with outage noise.
//!
//! So the belief at an entry is a function of the base and of the *set* of entries: not of the order, nor of the
//! ticks, in which they came. An arrival only marks what it may change (the entries after it; for odometry those
//! within its interval too), and one replay per tick brings these up to date.
//!
//! Entries leave at the old end only, a whole event at a time: the belief after the event becomes the base, so nothing is
//! recomputed and the beliefs after it are the same bits as before. What arrives for a stamp at or before the base is too old.
//! An odometry sample that began before the base but ends after it still drives what is after.
//!
//! A gyro's samples are no entries: they have a circle of their own (`turns.rs`) and drive beside the wheels, all of a leg at once. What
//! ends before a sample's stamp does not depend on it, so that each of them changes what comes after it alone.
//!
//! # Worst case
//!
//! Entries stay where they are in the storage; their order is kept in numbers of two bytes. A tick with K
//! measurements and a history of N entries takes
//!
//! ```text
//! K searches (log₂ N looks each)  +  K moves of at most 2N bytes  +  at most N + K entries applied again
//! ```
//!
//! however late they come and in whatever order: the replay is one, from the earliest entry that is touched; where the storage
//! is full, each newcomer makes the oldest event leave, which is applied once more before it does. To apply an entry
//! takes some 60 to 450 ns, the most where it is a neighbour's pose. Where odometry is missing between two entries, the samples
//! after the gap are looked through for one that has begun: at most N²/4 looks in all, each about a nanosecond.
//!
//! The replay is not spread over ticks on purpose: while it went on, the estimate would be one of the past, and a late
//! measurement a tick would keep it there. Instead the number of entries is bounded, by [`MOST_SLOTS`] and by who reserves
//! the storage; a benchmark (`tick-worst-of-1024`) holds the bound.

mod drive;
mod entry;
mod places;
mod replay;
mod ring;
mod settle;
mod storage;
mod tied;
mod turns;
mod ways;

use crate::assist::ties::Tied;
use crate::filter::Filter;
use crate::gyro::GyroSettings;
use crate::kind::{GyroSample, Key, Measured, Measurement, OdometrySample, RoundWord};
use crate::output::Verdict;
use crate::settings::Settings;
use crate::stamp::{Span, Stamp};

pub(crate) use drive::Drive;
use entry::{Checkpoint, Entry};
pub use places::MOST_SLOTS;
use ring::Ring;
pub(crate) use settle::Court;
pub use storage::{Parts, Storage, WithBonds, WithGyro};
use storage::{Samples, Slots};
pub use turns::GYRO_SAMPLES;
pub(crate) use turns::Turned;
use turns::{NotTaken, Turns};
use ways::Ways;

/// The shortest time there is.
const INSTANT: Span = Span::from_nanos(1);

/// One place in the history's storage; `Slot::default()` is an empty one.
#[derive(Copy, Clone, Debug, Default)]
pub struct Slot(Option<Entry>);

/// Whether it corrects the belief at a later slot than `last`, and acts.
fn is_later(word: &RoundWord, last: Option<u64>) -> bool {
    let slot = word.corrects().filter(|_| word.of.is_some());
    slot.is_some_and(|slot| last.is_none_or(|last| slot > last))
}

#[derive(Clone, Debug)]
pub(crate) struct History<S, G> {
    /// The filter after everything that has left the history.
    base: Checkpoint,
    /// The last odometry sample that has left it.
    base_odometry: Option<OdometrySample>,
    entries: Ring<S>,
    /// What drives beside the wheels.
    turns: Turns<G>,
    /// So many entries, from the oldest on, are up to date.
    evaluated: usize,
    ways: Ways,
}

impl<S: Slots, G: Samples> History<S, G> {
    /// An empty history that begins with `filter` at `stamp`.
    pub(crate) fn new(stamp: Stamp, filter: &Filter, (slots, samples): (S, G)) -> Self {
        Self {
            base: Checkpoint {
                stamp,
                filter: *filter,
                samples: 0,
            },
            base_odometry: None,
            entries: Ring::new(slots),
            turns: Turns::new(samples),
            evaluated: 0,
            ways: Ways::new(),
        }
    }

    /// The base's stamp: measurements must be later.
    pub(crate) fn begins(&self) -> Stamp {
        self.base.stamp
    }

    pub(crate) fn is_full(&self) -> bool {
        self.entries.is_full()
    }

    /// Where a measurement with `key` belongs; `None` if it is there already.
    pub(crate) fn place_of(&self, key: &Key) -> Option<usize> {
        self.entries.place_of(key).ok()
    }

    /// The measurement with `key`, if it is there.
    pub(crate) fn measurement(&self, key: &Key) -> Option<&Measurement> {
        let place = self.entries.place_of(key).err()?;
        Some(&self.entries.get(place)?.measurement)
    }

    /// Puts `measurement` in its `place`; false if the storage is full.
    #[must_use]
    pub(crate) fn insert(&mut self, place: usize, key: Key, measurement: &Measurement) -> bool {
        let inserted = self.entries.insert(place, key, measurement);
        if inserted {
            self.mark_from(self.first_affected(measurement, key, place));
            if measurement.as_odometry().is_some() {
                self.ways.forget_after(measurement.begins());
            }
        }
        inserted
    }

    /// Takes in what a gyro said: it drives what ends no earlier.
    pub(crate) fn turn(&mut self, sample: &GyroSample, settings: &Settings) -> Result<(), Verdict> {
        let Some(gyro) = settings.gyro() else {
            return Ok(()); // Nobody asks for it.
        };
        self.turns.insert(sample, gyro).map_err(|why| match why {
            NotTaken::Duplicate => Verdict::Duplicate,
            NotTaken::NoRoom => Verdict::NoRoom,
        })?;
        self.mark_from(self.entries.first_after(sample.stamp - INSTANT));
        Ok(())
    }

    /// What the gyro read last, and the density of its noise; `None` where that is too old.
    pub(crate) fn turning(&self, stamp: Stamp, settings: &Settings) -> Option<[f64; 2]> {
        self.turns.latest(stamp, settings.gyro()?)
    }

    /// Moves everything before `horizon` into the base.
    pub(crate) fn fold_before(&mut self, horizon: Stamp, court: &mut Court<'_>) {
        while self.oldest().is_some_and(|oldest| oldest < horizon) {
            self.settle_oldest(court);
        }
        if let Some(gyro) = self.gyro(court.settings) {
            self.fold_turns_before(horizon, gyro, court);
            self.turns.forget_before(self.base.stamp);
        }
    }

    /// Where the wheels are silent, the base follows the gyro from leg to leg: nothing is measured that would take it along. Legs that
    /// end before the horizon end where they would without it, so that the beliefs are the same.
    fn fold_turns_before(&mut self, horizon: Stamp, gyro: &GyroSettings, court: &mut Court<'_>) {
        loop {
            let Checkpoint { stamp, samples, .. } = self.base;
            if stamp >= horizon {
                return;
            }
            let mut leg = self.leg(stamp, horizon, samples, &court.settings.odometry);
            if leg.is_measured() {
                return;
            }
            let passage = self.turn_over(
                stamp,
                &mut leg,
                self.base.filter.bias.as_ref(),
                court.settings,
            );
            if leg.until >= horizon {
                return;
            }
            self.drive_hypotheses(leg.until, court);
            court.ties.break_off(leg.until);
            self.base.filter.predict_turning(&passage, gyro);
            self.base.stamp = leg.until;
        }
    }

    /// Frees room for a measurement stamped `newcomer` by folding the oldest event early; false if that event is not
    /// older than the newcomer, or not due at `now`.
    #[must_use]
    pub(crate) fn make_room(&mut self, newcomer: Stamp, now: Stamp, court: &mut Court<'_>) -> bool {
        let Some(oldest) = self
            .oldest()
            .filter(|&oldest| oldest < newcomer && oldest <= now)
        else {
            return false;
        };
        while self.oldest() == Some(oldest) {
            self.settle_oldest(court);
            court.outbox.count_folded_early();
        }
        true
    }

    /// A bias is carried along.
    #[inline]
    fn has_gyro(&self) -> bool {
        self.base.filter.bias.is_some()
    }

    /// A bond is carried along.
    #[inline]
    fn may_be_tied(&self) -> bool {
        self.base.filter.bond.is_some()
    }

    /// The first correction of a later slot than `last` that acts on anything, and its place.
    pub(crate) fn correction_after(&self, last: Option<u64>) -> Option<(usize, RoundWord)> {
        let mut places = (0..).map_while(|place| Some((place, self.entries.get(place)?)));
        places.find_map(|(place, entry)| match &entry.measurement {
            Measurement::Round(word) if is_later(word, last) => Some((place, *word)),
            _ => None,
        })
    }

    /// From `place` on they act on nothing any more.
    pub(crate) fn undo_from(&mut self, place: usize, last: Option<u64>) {
        for place in place.. {
            let Some(entry) = self.entries.get_mut(place) else {
                break;
            };
            if let Measurement::Round(word) = &mut entry.measurement
                && is_later(word, last)
            {
                word.of = None;
            }
        }
        self.mark_from(place);
    }

    /// How it is, where there is one.
    #[inline]
    fn gyro<'a>(&self, settings: &'a Settings) -> Option<&'a GyroSettings> {
        if self.has_gyro() {
            settings.gyro()
        } else {
            None
        }
    }

    fn oldest(&self) -> Option<Stamp> {
        self.entries.get(0).map(Entry::stamp)
    }

    fn fold_oldest(&mut self, ties: &mut Tied<'_>) {
        let (with_gyro, with_bond) = (self.has_gyro(), self.may_be_tied());
        if ties.is_on()
            && let (Some(entry), Some(slot)) = (self.entries.get(0), self.entries.slot_of(0))
        {
            ties.fold(&entry.key, slot);
        }
        let Some(entry) = self.entries.pop_front() else {
            return;
        };
        self.base = entry.after();
        if with_gyro {
            self.base.filter.bias = Some(entry.bias());
        }
        if with_bond {
            self.base.filter.bond = Some(entry.bond());
        }
        if let Some(sample) = entry.measurement.as_odometry() {
            self.base_odometry = Some(*sample);
        }
        self.evaluated = self.evaluated.saturating_sub(1);
    }

    /// The first entry whose belief the new entry at `place` may change.
    fn first_affected(&self, measurement: &Measurement, key: Key, place: usize) -> usize {
        let begins = measurement.begins();
        if begins < key.stamp {
            place.min(self.entries.first_after(begins))
        } else {
            place
        }
    }

    fn mark_from(&mut self, index: usize) {
        self.evaluated = self.evaluated.min(index);
    }

    /// The odometry samples from that number on.
    fn samples_from(&self, number: usize) -> impl Iterator<Item = &OdometrySample> {
        (number..).map_while(|number| self.entries.sample(number))
    }

    /// The last odometry sample before that number.
    fn last_sample_before(&self, number: usize) -> Option<&OdometrySample> {
        let within = number
            .checked_sub(1)
            .and_then(|before| self.entries.sample(before));
        within.or(self.base_odometry.as_ref())
    }
}
