//! A list with a fixed capacity: what does not fit is refused, and nothing is ever allocated after the start.

/// At most as many as were reserved.
#[derive(Debug)]
pub struct List<T>(Vec<T>);

impl<T> List<T> {
    /// Reserves room for `capacity`.
    #[must_use]
    pub fn with_capacity(capacity: usize) -> Self {
        Self(Vec::with_capacity(capacity))
    }

    /// Adds `value` if there is room.
    #[must_use]
    pub fn push(&mut self, value: T) -> bool {
        let fits = !self.is_full();
        if fits {
            self.0.push(value);
        }
        fits
    }

    /// Whether there is no room.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.0.len() == self.0.capacity()
    }

    /// Whether there is nothing in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Empties the list.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Takes the first `count` out.
    pub fn remove_first(&mut self, count: usize) {
        self.0.drain(..count.min(self.0.len()));
    }

    /// Puts what is in it in the order of `key`; two of one key in any order.
    pub fn sort_by_key<K: Ord>(&mut self, key: impl FnMut(&T) -> K) {
        self.0.sort_unstable_by_key(key); // The stable sort allocates.
    }

    /// What is in it, to be changed.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.0
    }

    /// What is in it.
    #[must_use]
    pub fn as_slice(&self) -> &[T] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused() {
        let mut list = List::with_capacity(2);
        let room = list.0.capacity();
        (0..room).for_each(|value| assert!(list.push(value)));
        assert!(!list.push(0));
        list.clear();
        assert!(list.push(7));
        assert_eq!(list.as_slice(), [7]);
    }

    #[test]
    fn it_is_sorted_in_place() {
        let mut list = List::with_capacity(3);
        for value in [5, 1, 3] {
            assert!(list.push(value));
        }
        list.sort_by_key(|value| *value);
        assert_eq!(list.as_slice(), [1, 3, 5]);
    }
}
