//! Which of the last messages of one count have come.

/// Messages behind the newest that are still told apart.
const WINDOW: u64 = u128::BITS as u64;

/// Who is so far ahead has not lost so many messages: it is another count.
const LEAP: u64 = 1 << 20;

/// The newest number so far, and which of those before it have come.
#[derive(Copy, Clone, Debug)]
pub(super) struct Window {
    first: u64,
    newest: u64,
    /// Bit k: newest − k has come.
    seen: u128,
}

/// What a number is to a window.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// News, after so many that have not come.
    Ahead { missing: u64 },
    /// One that was missing until now.
    Late,
    /// It came before the first that was received, so nobody missed it.
    Earlier,
    /// It has come already.
    Seen,
}

impl Window {
    pub(super) const fn beginning(sequence: u64) -> Self {
        Self {
            first: sequence,
            newest: sequence,
            seen: 1,
        }
    }

    /// How far away a number is that belongs to this count; `None` for those too far behind or ahead to be told.
    pub(super) fn distance(&self, sequence: u64) -> Option<u64> {
        let near = match sequence.checked_sub(self.newest) {
            Some(ahead) => ahead <= LEAP,
            None => self.newest - sequence < WINDOW,
        };
        near.then(|| self.newest.abs_diff(sequence))
    }

    /// Notes a number that is not too far away.
    pub(super) fn note(&mut self, sequence: u64) -> Place {
        match sequence.checked_sub(self.newest) {
            Some(0) => Place::Seen,
            Some(ahead) => self.move_on(ahead),
            None => self.fill_in(sequence),
        }
    }

    fn move_on(&mut self, ahead: u64) -> Place {
        let kept = u32::try_from(ahead)
            .ok()
            .and_then(|ahead| self.seen.checked_shl(ahead));
        self.newest += ahead;
        self.seen = kept.unwrap_or(0) | 1;
        Place::Ahead { missing: ahead - 1 }
    }

    fn fill_in(&mut self, sequence: u64) -> Place {
        let bit = 1 << (self.newest - sequence);
        if self.seen & bit != 0 {
            return Place::Seen;
        }
        self.seen |= bit;
        if sequence < self.first {
            Place::Earlier
        } else {
            Place::Late
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_does_not_matter_within_the_window() {
        let mut window = Window::beginning(127);
        for sequence in (0..127).rev() {
            assert_eq!(window.note(sequence), Place::Earlier, "{sequence}");
        }
        for sequence in 0..128 {
            assert_eq!(window.note(sequence), Place::Seen, "{sequence}");
        }
    }

    #[test]
    fn what_is_missing_is_counted_and_may_come_late() {
        let mut window = Window::beginning(10);
        assert_eq!(window.note(14), Place::Ahead { missing: 3 });
        assert_eq!(window.note(12), Place::Late);
        assert_eq!(window.note(12), Place::Seen);
        assert_eq!(window.note(9), Place::Earlier);
        assert_eq!(window.note(15), Place::Ahead { missing: 0 });
    }

    #[test]
    fn a_count_reaches_from_behind_its_window_to_a_leap_ahead() {
        let window = Window::beginning(1 << 30);
        for (sequence, distance) in [
            ((1 << 30) - 127, Some(127)),
            ((1 << 30) - 128, None),
            ((1 << 30) + LEAP, Some(LEAP)),
            ((1 << 30) + LEAP + 1, None),
            (u64::MAX, None),
            (0, None),
        ] {
            assert_eq!(window.distance(sequence), distance, "{sequence}");
        }
    }

    #[test]
    fn the_ends_of_the_count_do_no_harm() {
        let mut window = Window::beginning(u64::MAX - 1);
        assert_eq!(window.note(u64::MAX), Place::Ahead { missing: 0 });
        assert_eq!(window.distance(u64::MAX), Some(0));
        assert_eq!(Window::beginning(0).distance(0), Some(0));
    }
}
