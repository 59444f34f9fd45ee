//! Which numbers were here already.

/// The last numbers of one count, each of which passes once.
#[derive(Clone, Debug, Default)]
pub(super) struct Window {
    /// The next after the highest that was here.
    next: u64,
    /// Whether the numbers before it were here, number n at bit n mod [`Window::WIDTH`].
    seen: [u64; Self::WORDS],
}

impl Window {
    const WORDS: usize = 16;
    /// So many numbers behind the highest are told apart: 400 ms of messages that a robot says to fifty others fifty times a second.
    pub(super) const WIDTH: u64 = 64 * Self::WORDS as u64;

    /// Whether a number is new. One that is too far behind counts as old.
    pub(super) fn is_new(&self, number: u64) -> bool {
        if number >= self.next {
            return number < u64::MAX;
        }
        let near = self.next - number <= Self::WIDTH;
        near && self.seen[word(number)] & bit(number) == 0
    }

    /// Notes one that is new.
    pub(super) fn note(&mut self, number: u64) {
        if number >= self.next {
            let skipped = number - self.next;
            if skipped >= Self::WIDTH {
                self.seen = [0; Self::WORDS];
            } else {
                for between in self.next..number {
                    self.seen[word(between)] &= !bit(between);
                }
            }
            self.next = number.saturating_add(1);
        }
        self.seen[word(number)] |= bit(number);
    }
}

const fn word(number: u64) -> usize {
    (number % Window::WIDTH / 64) as usize
}

const fn bit(number: u64) -> u64 {
    1 << (number % 64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    use super::*;

    proptest! {
        #[test]
        fn each_number_passes_once_and_none_far_behind(numbers in prop::collection::vec(0..4000_u64, 1..400)) {
            let mut window = Window::default();
            let mut seen = BTreeSet::new();
            for number in numbers {
                let highest = seen.last().copied().unwrap_or(0);
                let near = number + Window::WIDTH > highest;
                prop_assert_eq!(window.is_new(number), near && !seen.contains(&number));
                if window.is_new(number) {
                    window.note(number);
                    seen.insert(number);
                }
            }
        }
    }
}
