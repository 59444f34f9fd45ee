//! A ring of entries over storage that the caller supplies.

use super::Slot;
use super::entry::{Entry, Measurement};

/// Entries `0..len`, oldest first. Taking the oldest and appending cost nothing; inserting moves what is newer.
#[derive(Clone, Debug)]
pub(crate) struct Ring<S> {
    storage: S,
    head: usize,
    len: usize,
}

impl<S: AsRef<[Slot]> + AsMut<[Slot]>> Ring<S> {
    pub(crate) fn new(storage: S) -> Self {
        Self {
            storage,
            head: 0,
            len: 0,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn is_full(&self) -> bool {
        self.len >= self.storage.as_ref().len()
    }

    pub(crate) fn get(&self, index: usize) -> Option<&Entry> {
        let slot = self.slot(index)?;
        self.storage.as_ref().get(slot)?.0.as_ref()
    }

    pub(crate) fn get_mut(&mut self, index: usize) -> Option<&mut Entry> {
        self.slot_mut(index)?.0.as_mut()
    }

    /// Puts `measurement` before the entry at `index`; false if there is no room.
    #[must_use]
    pub(crate) fn insert(&mut self, index: usize, measurement: Measurement) -> bool {
        if self.is_full() || index > self.len {
            return false;
        }
        self.len += 1;
        for newer in (index + 1..self.len).rev() {
            self.copy(newer - 1, newer);
        }
        if let Some(slot) = self.slot_mut(index) {
            slot.0 = Some(Entry::new(measurement));
        }
        true
    }

    /// Takes the oldest entry out.
    pub(crate) fn pop_front(&mut self) -> Option<Entry> {
        let oldest = self.slot_mut(0)?.0.take();
        self.head = (self.head + 1) % self.storage.as_ref().len();
        self.len -= 1;
        oldest
    }

    pub(crate) fn clear(&mut self) {
        while self.pop_front().is_some() {}
    }

    fn copy(&mut self, from: usize, to: usize) {
        let entry = self.get(from).copied();
        if let Some(slot) = self.slot_mut(to) {
            slot.0 = entry;
        }
    }

    fn slot_mut(&mut self, index: usize) -> Option<&mut Slot> {
        let slot = self.slot(index)?;
        self.storage.as_mut().get_mut(slot)
    }

    /// Where entry `index` is stored, if there is one.
    fn slot(&self, index: usize) -> Option<usize> {
        let capacity = self.storage.as_ref().len();
        (index < self.len && capacity > 0).then(|| (self.head + index) % capacity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance2;
    use crate::input::PositionFix;
    use crate::stamp::Stamp;

    fn fix(stamp: i64) -> Measurement {
        Measurement::Fix(PositionFix {
            stamp: Stamp::from_nanos(stamp),
            sequence: 0,
            position: [0.0; 2],
            covariance: Covariance2::ZERO,
        })
    }

    fn stamps<const N: usize>(ring: &Ring<[Slot; N]>) -> [i64; N] {
        core::array::from_fn(|i| ring.get(i).map_or(-1, |e| e.stamp().as_nanos()))
    }

    #[test]
    fn keeps_its_order_across_the_end_of_the_storage() {
        let mut ring = Ring::new([Slot::default(); 4]);
        for stamp in [1, 2, 4] {
            assert!(ring.insert(ring.len(), fix(stamp)));
        }
        assert_eq!(ring.pop_front().map(|e| e.stamp().as_nanos()), Some(1));
        assert_eq!(ring.pop_front().map(|e| e.stamp().as_nanos()), Some(2));
        assert!(ring.insert(1, fix(6)) && ring.insert(1, fix(5)) && ring.insert(0, fix(3)));
        assert_eq!(stamps(&ring), [3, 4, 5, 6]);
    }

    #[test]
    fn refuses_what_does_not_fit() {
        let mut ring = Ring::new([Slot::default(); 1]);
        assert!(ring.insert(0, fix(1)));
        assert!(!ring.insert(0, fix(2)));
        assert_eq!(stamps(&ring), [1]);
    }

    #[test]
    fn without_storage_there_is_no_room_and_no_panic() {
        let nothing: [Slot; 0] = [];
        let mut ring = Ring::new(nothing);
        assert!(!ring.insert(0, fix(1)));
        assert!(ring.pop_front().is_none());
    }
}
