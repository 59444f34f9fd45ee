//! Which event a stamp belongs to: everybody computes it, nobody announces it.

use crate::stamp::{Span, Stamp};

/// The number of an event.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Slot(pub i64);

/// One event a period; the same on every robot of a team.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Slots {
    period: Span,
    phase: Span,
}

impl Slots {
    /// `None` of a period that is not positive.
    #[must_use]
    pub fn new(period: Span, phase: Span) -> Option<Self> {
        (period > Span::ZERO).then_some(Self { period, phase })
    }

    /// How long an event is.
    #[must_use]
    pub fn period(&self) -> Span {
        self.period
    }

    /// When an event begins, as far as that can be a stamp.
    #[must_use]
    pub fn begin(&self, slot: Slot) -> Stamp {
        let since = slot.0.saturating_mul(self.period.as_nanos());
        Stamp::from_nanos(since.saturating_add(self.phase.as_nanos()))
    }

    /// `⌊(stamp − phase)/period⌋`
    #[must_use]
    pub fn of(&self, stamp: Stamp) -> Slot {
        let since = (stamp - self.phase).as_nanos();
        Slot(since.div_euclid(self.period.as_nanos()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_begins_with_its_first_nanosecond() {
        let slots = Slots::new(Span::from_millis(200), Span::from_millis(50)).unwrap();
        let of = |millis: i64| slots.of(Stamp::from_nanos(millis * 1_000_000));
        let expected = [
            (49, -1),
            (50, 0),
            (249, 0),
            (250, 1),
            (-151, -2),
            (-150, -1),
        ];
        for (millis, slot) in expected {
            assert_eq!(of(millis), Slot(slot), "{millis}");
        }
        assert_eq!(
            slots.of(Stamp::from_nanos(i64::MIN)),
            slots.of(Stamp::from_nanos(i64::MIN + 1))
        );
        assert!(Slots::new(Span::ZERO, Span::ZERO).is_none());
    }
}
