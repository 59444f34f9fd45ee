//! The fixed-capacity history of beliefs, odometry and measurements.
//!
//! # Model
//!
//! Measurements lie in the order of their stamps; equal stamps form one event, ordered as Algorithm 4 handles it:
//! odometry, own sightings, neighbours' poses, fixes, then by sender and sequence. Each entry keeps the belief after it.
//! What lies before the oldest entry is the *base*: a stamp and the belief then.
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

mod drive;
mod entry;
mod replay;
mod ring;

use core::cmp::Ordering;

use crate::belief::Belief;
use crate::input::OdometrySample;
use crate::outbox::Outbox;
use crate::pace::Pace;
use crate::settings::Settings;
use crate::stamp::Stamp;

pub(crate) use entry::Measurement;
use entry::{Checkpoint, Entry, Key};
use ring::Ring;

/// One place in the history's storage; `Slot::default()` is an empty one.
#[derive(Copy, Clone, Debug, Default)]
pub struct Slot(Option<Entry>);

#[derive(Clone, Debug)]
pub(crate) struct History<S> {
    /// The belief after everything that has left the history.
    base: Checkpoint,
    /// The last odometry sample that has left it.
    base_odometry: Option<OdometrySample>,
    entries: Ring<S>,
    /// So many entries, from the oldest on, have a belief that is up to date.
    evaluated: usize,
}

impl<S: AsRef<[Slot]> + AsMut<[Slot]>> History<S> {
    /// An empty history that begins with `belief` at `stamp`.
    pub(crate) fn new(stamp: Stamp, belief: Belief, storage: S) -> Self {
        Self {
            base: Checkpoint {
                stamp,
                belief,
                exchanged: false,
                pace: Pace::beginning(stamp),
            },
            base_odometry: None,
            entries: Ring::new(storage),
            evaluated: 0,
        }
    }

    /// The base's stamp: measurements must be later.
    pub(crate) fn begins(&self) -> Stamp {
        self.base.stamp
    }

    pub(crate) fn is_full(&self) -> bool {
        self.entries.is_full()
    }

    /// Whether this measurement is in the history already.
    pub(crate) fn contains(&self, measurement: &Measurement) -> bool {
        self.place_of(&measurement.key()).is_err()
    }

    /// Puts `measurement` in its place, unless it is there already or the storage is full.
    #[must_use]
    pub(crate) fn insert(&mut self, measurement: Measurement) -> bool {
        let Ok(place) = self.place_of(&measurement.key()) else {
            return false;
        };
        let inserted = self.entries.insert(place, measurement);
        if inserted {
            self.mark_from(self.first_affected(&measurement, place));
        }
        inserted
    }

    /// Moves everything before `horizon` that is up to date into the base.
    pub(crate) fn fold_before(&mut self, horizon: Stamp) {
        while self.evaluated > 0 && self.oldest().is_some_and(|oldest| oldest < horizon) {
            self.fold_oldest();
        }
    }

    /// Frees room for a measurement stamped `newcomer` by folding the oldest event early; false if that event is not
    /// older than the newcomer, or not due at `now`.
    #[must_use]
    pub(crate) fn make_room(
        &mut self,
        newcomer: Stamp,
        now: Stamp,
        settings: &Settings,
        outbox: &mut Outbox,
    ) -> bool {
        let Some(oldest) = self
            .oldest()
            .filter(|&oldest| oldest < newcomer && oldest <= now)
        else {
            return false;
        };
        self.replay(oldest, settings, outbox);
        while self.oldest() == Some(oldest) {
            self.fold_oldest();
            outbox.count_folded_early();
        }
        true
    }

    /// Forgets all entries; what was believed at `old`, and the velocity held then, are the base at `new`.
    pub(crate) fn rebase(&mut self, old: Stamp, new: Stamp, settings: &Settings) {
        let belief = self.belief_at(old, &settings.odometry);
        let pace = self.pace_at(old);
        let odometry = self.last_sample_before(self.first_after(old)).copied();
        let shift = new - old;
        self.base = Checkpoint {
            stamp: new,
            belief,
            exchanged: false,
            pace: pace.shifted(shift),
        };
        self.base_odometry = odometry.map(|sample| OdometrySample {
            start: sample.start + shift,
            stamp: sample.stamp + shift,
            ..sample
        });
        self.entries.clear();
        self.evaluated = 0;
    }

    fn oldest(&self) -> Option<Stamp> {
        self.entries.get(0).map(Entry::stamp)
    }

    fn fold_oldest(&mut self) {
        let Some(entry) = self.entries.pop_front() else {
            return;
        };
        self.evaluated = self.evaluated.saturating_sub(1);
        self.base = entry.after;
        self.base_odometry = entry
            .measurement
            .as_odometry()
            .copied()
            .or(self.base_odometry);
    }

    /// Where an entry with `key` belongs, searched from the new end where most belong; `Err` if it is there.
    fn place_of(&self, key: &Key) -> Result<usize, usize> {
        let mut place = self.entries.len();
        while let Some(before) = place
            .checked_sub(1)
            .and_then(|index| self.entries.get(index))
        {
            match before.key().cmp(key) {
                Ordering::Less => break,
                Ordering::Equal => return Err(place - 1),
                Ordering::Greater => place -= 1,
            }
        }
        Ok(place)
    }

    /// The first entry whose belief the new entry at `place` may change.
    fn first_affected(&self, measurement: &Measurement, place: usize) -> usize {
        match measurement.as_odometry() {
            Some(sample) => place.min(self.first_after(sample.start)),
            None => place,
        }
    }

    fn mark_from(&mut self, index: usize) {
        self.evaluated = self.evaluated.min(index);
    }

    /// Index of the first entry stamped after `stamp`.
    fn first_after(&self, stamp: Stamp) -> usize {
        let mut index = self.entries.len();
        while index > 0
            && self
                .entries
                .get(index - 1)
                .is_some_and(|entry| entry.stamp() > stamp)
        {
            index -= 1;
        }
        index
    }

    /// The odometry samples among the entries from `index` on.
    fn samples_from(&self, index: usize) -> impl Iterator<Item = &OdometrySample> {
        (index..self.entries.len()).filter_map(|index| self.sample(index))
    }

    /// The last odometry sample before the entry at `index`.
    fn last_sample_before(&self, index: usize) -> Option<&OdometrySample> {
        let within = (0..index).rev().find_map(|index| self.sample(index));
        within.or(self.base_odometry.as_ref())
    }

    fn sample(&self, index: usize) -> Option<&OdometrySample> {
        self.entries.get(index)?.measurement.as_odometry()
    }
}
