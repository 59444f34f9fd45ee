//! The entries in their order, over storage that the caller supplies.

use super::Slot;
use super::entry::Entry;
use super::places::{Places, count_before};
use crate::kind::{Key, Measurement, OdometrySample};
use crate::stamp::Stamp;

/// Entries `0..len`, oldest first, and the odometry samples among them.
#[derive(Clone, Debug)]
pub(crate) struct Ring<S> {
    storage: S,
    entries: Places,
    samples: Places,
    /// So many samples have left: the oldest that is here has this number.
    first_sample: usize,
}

impl<S: AsRef<[Slot]> + AsMut<[Slot]>> Ring<S> {
    pub(crate) fn new(storage: S) -> Self {
        let capacity = storage.as_ref().len();
        Self {
            storage,
            entries: Places::new(capacity),
            samples: Places::new(capacity),
            first_sample: 0,
        }
    }

    pub(crate) fn is_full(&self) -> bool {
        self.entries.is_full()
    }

    #[inline]
    pub(crate) fn get(&self, index: usize) -> Option<&Entry> {
        self.in_slot(self.entries.get(index)?)
    }

    /// Where it is in the storage.
    #[inline]
    pub(crate) fn slot_of(&self, index: usize) -> Option<usize> {
        self.entries.get(index)
    }

    #[inline]
    pub(crate) fn get_mut(&mut self, index: usize) -> Option<&mut Entry> {
        let slot = self.entries.get(index)?;
        self.storage.as_mut().get_mut(slot)?.0.as_mut()
    }

    /// Where an entry with `key` belongs; `Err` if it is there.
    pub(crate) fn place_of(&self, key: &Key) -> Result<usize, usize> {
        let place = count_before(self.entries.len(), |index| {
            self.get(index).is_some_and(|entry| entry.key < *key)
        });
        match self.get(place) {
            Some(entry) if entry.key == *key => Err(place),
            _ => Ok(place),
        }
    }

    /// Index of the first entry stamped after `stamp`.
    pub(crate) fn first_after(&self, stamp: Stamp) -> usize {
        count_before(self.entries.len(), |index| {
            self.get(index).is_some_and(|entry| entry.stamp() <= stamp)
        })
    }

    /// Puts `measurement` before the entry at `place`; false if there is no room.
    #[must_use]
    pub(crate) fn insert(&mut self, place: usize, key: Key, measurement: &Measurement) -> bool {
        let Some(slot) = self.entries.free() else {
            return false;
        };
        if !self.entries.insert(place, slot) {
            return false;
        }
        if measurement.as_odometry().is_some() {
            let before = self.samples_before(|entry| entry.key < key);
            // There is room: no more samples than entries.
            let _ = self.samples.insert(before, slot);
        }
        if let Some(slot) = self.storage.as_mut().get_mut(slot) {
            match &mut slot.0 {
                Some(entry) => entry.become_new(key, measurement), // Of what was here nothing is left.
                empty => *empty = Some(Entry::new(key, measurement)),
            }
        }
        true
    }

    /// Takes the oldest entry out.
    pub(crate) fn pop_front(&mut self) -> Option<&Entry> {
        let slot = self.entries.pop_front()?;
        if self.samples.get(0) == Some(slot) {
            let _ = self.samples.pop_front();
            self.first_sample += 1;
        }
        self.in_slot(slot)
    }

    /// The number of the first sample stamped after `stamp`.
    pub(crate) fn first_sample_after(&self, stamp: Stamp) -> usize {
        self.first_sample + self.samples_before(|entry| entry.stamp() <= stamp)
    }

    /// The sample with that number, counted over all that ever were here; `None` if it has left or is still to come.
    #[inline]
    pub(crate) fn sample(&self, number: usize) -> Option<&OdometrySample> {
        let slot = self.samples.get(number.checked_sub(self.first_sample)?)?;
        self.in_slot(slot)?.measurement.as_odometry()
    }

    fn samples_before(&self, is_before: impl Fn(&Entry) -> bool) -> usize {
        count_before(self.samples.len(), |index| {
            let slot = self.samples.get(index);
            slot.and_then(|slot| self.in_slot(slot))
                .is_some_and(&is_before)
        })
    }

    #[inline]
    fn in_slot(&self, slot: usize) -> Option<&Entry> {
        self.storage.as_ref().get(slot)?.0.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance2;
    use crate::kind::{Measured, Origin, PositionFix, SlowError};
    use crate::motion::Motion;

    fn put<const N: usize>(ring: &mut Ring<[Slot; N]>, measurement: Measurement) -> bool {
        let key = measurement.key();
        ring.place_of(&key)
            .is_ok_and(|place| ring.insert(place, key, &measurement))
    }

    fn fix(stamp: i64) -> Measurement {
        Measurement::Fix(PositionFix {
            stamp: Stamp::from_nanos(stamp),
            origin: Origin::default(),
            position: [0.0; 2],
            covariance: Covariance2::ZERO,
            lever: [0.0; 2],
            slow: SlowError::default(),
        })
    }

    fn sample(stamp: i64) -> Measurement {
        Measurement::Odometry(OdometrySample {
            source: 0,
            start: Stamp::from_nanos(stamp - 1),
            stamp: Stamp::from_nanos(stamp),
            motion: Motion::standstill([0.0; 3]),
        })
    }

    fn stamps<const N: usize>(ring: &Ring<[Slot; N]>) -> [i64; N] {
        core::array::from_fn(|i| ring.get(i).map_or(-1, |e| e.stamp().as_nanos()))
    }

    #[test]
    fn entries_are_in_the_order_of_their_keys_wherever_they_are_stored() {
        let mut ring = Ring::new([Slot::default(); 4]);
        for stamp in [2, 1, 4] {
            assert!(put(&mut ring, fix(stamp)));
        }
        for stamp in [1, 2] {
            let oldest = ring.pop_front().map(Entry::stamp);
            assert_eq!(oldest, Some(Stamp::from_nanos(stamp)));
        }
        assert!([6, 5, 3].map(|stamp| put(&mut ring, fix(stamp))) == [true; 3]);
        assert_eq!(stamps(&ring), [3, 4, 5, 6]);
        assert_eq!(ring.place_of(&fix(5).key()), Err(2));
        assert_eq!(ring.first_after(Stamp::from_nanos(4)), 2);
    }

    #[test]
    fn samples_keep_their_numbers_when_older_ones_leave() {
        let mut ring = Ring::new([Slot::default(); 8]);
        for measurement in [fix(1), sample(2), fix(3), sample(6), fix(5), sample(4)] {
            assert!(put(&mut ring, measurement));
        }
        let stamp_of = |ring: &Ring<[Slot; 8]>, number| {
            ring.sample(number).map(|sample| sample.stamp.as_nanos())
        };
        assert_eq!(
            [0, 1, 2, 3].map(|n| stamp_of(&ring, n)),
            [Some(2), Some(4), Some(6), None]
        );
        for _ in 0..3 {
            assert!(ring.pop_front().is_some());
        }
        assert_eq!(
            [0, 1, 2].map(|n| stamp_of(&ring, n)),
            [None, Some(4), Some(6)]
        );
        assert_eq!(ring.first_sample_after(Stamp::from_nanos(5)), 2);
    }

    #[test]
    fn refuses_what_does_not_fit() {
        let mut ring = Ring::new([Slot::default(); 1]);
        assert!(put(&mut ring, fix(1)));
        assert!(ring.is_full() && !put(&mut ring, fix(2)));
        assert_eq!(stamps(&ring), [1]);
    }

    #[test]
    fn without_storage_there_is_no_room_and_no_panic() {
        let nothing: [Slot; 0] = [];
        let mut ring = Ring::new(nothing);
        assert!(!put(&mut ring, fix(1)));
        assert!(ring.pop_front().is_none());
    }
}
