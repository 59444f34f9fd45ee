//! How often, and how much at a time.
use std::time::{Duration, Instant};

/// Which files are looked at: all, or a few of each kind at a time, so that in a big fleet it costs little.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Turn {
    start: usize,
    count: usize,
}

impl Turn {
    pub(crate) const ALL: Self = Self {
        start: 0,
        count: usize::MAX,
    };
    const FEW: usize = 32;

    /// All have had their turn after some numbers.
    fn of_a_few(number: usize) -> Self {
        Self {
            start: number.wrapping_mul(Self::FEW),
            count: Self::FEW,
        }
    }

    pub(super) fn of<T>(self, all: &[T]) -> impl Iterator<Item = &T> {
        let (front, back) = all.split_at(self.start % all.len().max(1));
        back.iter().chain(front).take(self.count)
    }
}

/// For whoever does it again and again.
#[derive(Debug, Default)]
pub(crate) struct Broom {
    turns: usize,
    not_before: Option<Instant>,
}

impl Broom {
    /// Between two turns there are so many times as long as one takes.
    const REST: u32 = 200;

    /// What `remove` says, or 0 if it is too early.
    pub(crate) fn sweep(&mut self, remove: impl FnOnce(Turn) -> usize) -> usize {
        let start = Instant::now();
        if self.not_before.is_some_and(|then| start < then) {
            return 0;
        }
        let removed = remove(Turn::of_a_few(self.turns));
        self.turns = self.turns.wrapping_add(1);
        let took = start.elapsed().min(Duration::from_millis(50));
        self.not_before = Some(Instant::now() + took * Self::REST);
        removed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everybody_has_a_turn() {
        for length in [0, 1, 31, 32, 33, 100] {
            let all: Vec<_> = (0..length).collect();
            let looked_at = |turn: Turn| turn.of(&all).copied().collect::<Vec<usize>>();
            assert_eq!(looked_at(Turn::ALL), all);
            let mut seen: Vec<_> = (7..11)
                .flat_map(|number| looked_at(Turn::of_a_few(number)))
                .collect();
            assert!(seen.len() <= 4 * Turn::FEW);
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen, all);
        }
    }

    #[test]
    fn who_took_long_rests_long() {
        let mut broom = Broom::default();
        let long = |_| {
            std::thread::sleep(Duration::from_millis(60));
            3
        };
        assert_eq!(broom.sweep(long), 3);
        assert_eq!(broom.sweep(|_| 5), 0, "ten seconds have not passed");
    }
}
