//! A list with a fixed capacity.

/// At most `N` items, in place.
#[derive(Copy, Clone, Debug)]
pub(crate) struct FixedList<T, const N: usize> {
    items: [T; N],
    len: usize,
}

impl<T: Copy, const N: usize> FixedList<T, N> {
    /// An empty list; `filler` occupies the places that are not in use.
    pub(crate) fn new(filler: T) -> Self {
        Self {
            items: [filler; N],
            len: 0,
        }
    }

    /// Appends `item`; false if the list is full.
    #[must_use]
    pub(crate) fn push(&mut self, item: T) -> bool {
        let Some(place) = self.items.get_mut(self.len) else {
            return false;
        };
        *place = item;
        self.len += 1;
        true
    }

    /// Puts `item` before that at `index`; false if the list is full or ends before it.
    #[must_use]
    pub(crate) fn insert(&mut self, index: usize, item: T) -> bool {
        if index > self.len || !self.push(item) {
            return false;
        }
        self.as_mut_slice()
            .get_mut(index..)
            .unwrap_or(&mut [])
            .rotate_right(1);
        true
    }

    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    pub(crate) fn as_slice(&self) -> &[T] {
        self.items.get(..self.len).unwrap_or(&[])
    }

    pub(crate) fn as_mut_slice(&mut self) -> &mut [T] {
        self.items.get_mut(..self.len).unwrap_or(&mut [])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_list_says_so_and_keeps_what_it_has() {
        let mut list = FixedList::<u8, 2>::new(0);
        assert!(list.push(7) && list.push(8));
        assert!(!list.push(9));
        assert_eq!(list.as_slice(), [7, 8]);
    }

    #[test]
    fn a_cleared_list_is_empty() {
        let mut list = FixedList::<u8, 2>::new(0);
        assert!(list.push(7));
        list.clear();
        assert!(list.as_slice().is_empty());
    }
}
