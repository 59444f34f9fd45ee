//! The order of the entries: which slot of the storage is the first, the second and so on.
//!
//! Entries are large and stay where they are; what moves when one comes in between is two bytes for each that is newer.

/// So many slots are used at most; a late measurement can make a tick apply all of them again (see [`super`]).
pub const MOST_SLOTS: usize = 4096;

/// Slot numbers `0..len`, oldest first, in a circle of [`MOST_SLOTS`]. Behind them are those that are in no place, up to
/// `capacity` in all: together they are each slot once, as long as only free ones are put into places.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    slots: [u16; MOST_SLOTS],
    capacity: usize,
    head: usize,
    len: usize,
}

const LAST: usize = MOST_SLOTS - 1;
const _: () = assert!(MOST_SLOTS.is_power_of_two());

impl Places {
    /// None yet, with room for `capacity`, at most [`MOST_SLOTS`].
    pub(crate) fn new(capacity: usize) -> Self {
        Self {
            #[allow(clippy::cast_possible_truncation)] // MOST_SLOTS is far below 2^16.
            slots: core::array::from_fn(|slot| slot as u16),
            capacity: capacity.min(MOST_SLOTS),
            head: 0,
            len: 0,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn is_full(&self) -> bool {
        self.len >= self.capacity
    }

    #[inline]
    pub(crate) fn get(&self, index: usize) -> Option<usize> {
        (index < self.len).then(|| self.slot(index))
    }

    /// A slot that is in no place.
    pub(crate) fn free(&self) -> Option<usize> {
        (!self.is_full()).then(|| self.slot(self.len))
    }

    /// Puts `slot` before the one at `index`; false if there is no room.
    #[must_use]
    pub(crate) fn insert(&mut self, index: usize, slot: usize) -> bool {
        let Ok(slot) = u16::try_from(slot) else {
            return false;
        };
        if self.is_full() || index > self.len {
            return false;
        }
        if index < self.len {
            self.make_way(index);
        }
        self.len += 1;
        self.put(index, slot);
        true
    }

    /// Takes the oldest out. It is the first of the free ones: what was just read is in the caches when it is written again. The
    /// one that was the first is the last.
    #[inline]
    #[allow(clippy::cast_possible_truncation)] // They come out of places.
    pub(crate) fn pop_front(&mut self) -> Option<usize> {
        let oldest = self.get(0)?;
        let free = self.slot(self.len);
        self.put(self.capacity, free as u16);
        self.put(self.len, oldest as u16);
        self.head = self.at(1);
        self.len -= 1;
        Some(oldest)
    }

    /// Moves all from `index` on one place further, in two pieces where they lie across the end of the circle.
    fn make_way(&mut self, index: usize) {
        let (from, free) = (self.at(index), self.at(self.len));
        if from <= free {
            self.slots.copy_within(from..free, from + 1);
            return;
        }
        self.slots.copy_within(0..free, 1);
        self.slots.copy_within(LAST..=LAST, 0);
        self.slots.copy_within(from..LAST, from + 1);
    }

    #[inline]
    fn slot(&self, index: usize) -> usize {
        self.slots
            .get(self.at(index))
            .map_or(0, |&slot| usize::from(slot)) // It is in the circle.
    }

    #[inline]
    fn put(&mut self, index: usize, slot: u16) {
        let place = self.at(index);
        if let Some(place) = self.slots.get_mut(place) {
            *place = slot;
        }
    }

    /// Where number `index` is in the circle.
    #[inline]
    fn at(&self, index: usize) -> usize {
        self.head.wrapping_add(index) & LAST
    }
}

/// How many of `len` things come first for which `is_before` holds: for all of these and for none after them. Mostly it
/// does for nearly all, so the search begins at the end, with strides that double.
#[inline]
pub(crate) fn count_before(len: usize, is_before: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high, mut stride) = (0, len, 1);
    while high > 0 {
        let probe = high.saturating_sub(stride);
        if is_before(probe) {
            low = probe + 1;
            break;
        }
        (high, stride) = (probe, 2 * stride);
    }
    while low < high {
        let middle = low.midpoint(high);
        if is_before(middle) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(places: &Places) -> [Option<usize>; 5] {
        core::array::from_fn(|index| places.get(index))
    }

    #[test]
    fn the_order_is_kept_wherever_the_circle_begins() {
        for turned in 0..5 {
            for index in 0..4 {
                let mut places = Places::new(4);
                places.head = LAST - 3 + turned;
                for slot in 0..3 {
                    assert!(places.insert(slot, slot));
                }
                assert!(places.insert(index, 7));
                let mut expected = [Some(0), Some(1), Some(2), None, None];
                expected[index..4].rotate_right(1);
                expected[index] = Some(7);
                assert_eq!(listed(&places), expected, "{index} of {turned}");
                assert!(places.is_full() && !places.insert(0, 8));
            }
        }
    }

    #[test]
    fn a_slot_is_free_until_it_has_a_place_and_again_when_it_was_taken_out() {
        let mut places = Places::new(3);
        for index in [0, 0, 1] {
            let free = places.free().unwrap();
            assert!(places.insert(index, free));
        }
        let mut taken = [(); 3].map(|()| {
            let taken = places.pop_front().unwrap();
            assert_eq!(places.free(), Some(taken), "it is used next");
            taken
        });
        taken.sort_unstable();
        assert_eq!(taken, [0, 1, 2]);
        assert!(places.insert(0, 0) && places.free() != Some(0));
    }

    #[test]
    fn without_room_there_is_no_place_and_no_panic() {
        let mut places = Places::new(0);
        assert!(places.is_full() && !places.insert(0, 0));
        assert_eq!((places.pop_front(), places.free()), (None, None));
    }

    #[test]
    fn what_comes_before_is_counted_for_every_length() {
        for len in 0..40 {
            for before in 0..=len {
                assert_eq!(count_before(len, |index| index < before), before);
            }
        }
    }
}
