//! What came of one source, or of all of one kind, and how it is doing by that.

use coloc_drivers::is_broken;
use coloc_estimator::Stamp;
use coloc_shm_types::{Health, Rhythm};

use super::fact::Fact;
use super::patience::Patience;

/// So many refusals in a row are no accident: of honest inputs a gate of 99 % refuses three in a row once in a million.
const REFUSALS: u32 = 3;

#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Sensor {
    patience: Patience,
    /// Stamp of the newest valid input.
    newest: Option<Stamp>,
    /// When the last invalid one came.
    invalid: Option<Stamp>,
    /// From one valid input to the next. Samples of one moment, and those that come late, say nothing of it.
    rhythm: Rhythm,
    /// Valid ones in a row that changed nothing.
    refused: u32,
    /// The newest of these was beyond the gate.
    gated: bool,
    /// Nothing has passed since.
    fails_since: Option<Stamp>,
}

impl Sensor {
    pub(super) fn new(patience: Patience) -> Self {
        Self {
            patience,
            ..Self::default()
        }
    }

    /// It happened at `now`.
    #[inline]
    pub(super) fn note(&mut self, fact: Fact, now: Stamp) {
        match fact {
            Fact::Valid(stamp) => self.came(stamp),
            Fact::Passed { .. } => (self.refused, self.fails_since) = (0, None),
            Fact::Refused { d2 } => {
                (self.refused, self.gated) = (self.refused.saturating_add(1), d2.is_some());
                self.fails_since.get_or_insert(now);
            }
            Fact::Invalid => {
                self.invalid = Some(now);
                self.fails_since.get_or_insert(now);
            }
            Fact::Repeated => {}
        }
    }

    fn came(&mut self, stamp: Stamp) {
        let before = *self.newest.get_or_insert(stamp);
        self.rhythm.note((stamp - before).as_nanos());
        self.newest = Some(before.max(stamp));
    }

    /// At the tick stamped `now`.
    pub(super) fn at(&self, now: Stamp) -> Health {
        let patience = || self.patience.with(self.rhythm.interval_ns());
        let comes = self.newest.is_some_and(|it| now - it <= patience());
        let garbled = || {
            self.invalid
                .is_some_and(|it| now - it <= self.patience.least)
        };
        match () {
            () if comes && self.refused >= REFUSALS => Health::Refused,
            () if is_broken("stale") || comes => Health::Ok,
            () if garbled() => Health::Faulty,
            () if self.newest.is_some() => Health::Stale,
            () => Health::NeverSeen,
        }
    }

    /// Stamp of the newest valid input.
    pub(super) fn newest(&self) -> Option<Stamp> {
        self.newest
    }

    /// Since when nothing has passed, if the newest did not.
    pub(super) fn fails_since(&self) -> Option<Stamp> {
        self.fails_since
    }

    /// Whether the newest that was refused was beyond the gate.
    pub(super) fn is_gated(&self) -> bool {
        self.gated
    }
}

#[cfg(test)]
mod tests {
    use coloc_estimator::Span;

    use super::*;

    const PASSED: Fact = Fact::Passed { count: 1, d2: None };

    /// As wheels are waited for.
    fn wheels() -> Sensor {
        Sensor::new(Patience {
            least: Span::from_millis(100),
            adapts: false,
        })
    }

    /// As all others are.
    fn slow() -> Sensor {
        Sensor::new(Patience {
            least: Span::from_millis(1000),
            adapts: true,
        })
    }

    fn stamp(millis: i64) -> Stamp {
        Stamp::default() + Span::from_millis(millis)
    }

    fn came(sensor: &mut Sensor, millis: i64) {
        sensor.note(Fact::Valid(stamp(millis)), stamp(millis));
    }

    #[test]
    fn stale_begins_right_after_the_threshold() {
        let mut sensor = wheels();
        assert_eq!(sensor.at(stamp(1000)), Health::NeverSeen);
        came(&mut sensor, 1000);
        assert_eq!(sensor.at(stamp(1100)), Health::Ok);
        let later = stamp(1100) + Span::from_nanos(1);
        assert_eq!(sensor.at(later), Health::Stale);
    }

    #[test]
    fn garbage_alone_is_faulty_and_ends_when_it_ends() {
        let mut sensor = wheels();
        sensor.note(Fact::Invalid, stamp(1000));
        assert_eq!(sensor.at(stamp(1000)), Health::Faulty);
        assert_eq!(sensor.at(stamp(1200)), Health::NeverSeen);
    }

    #[test]
    fn garbage_among_good_samples_is_counted_elsewhere() {
        let mut sensor = wheels();
        came(&mut sensor, 1000);
        sensor.note(Fact::Invalid, stamp(1010));
        assert_eq!(sensor.at(stamp(1020)), Health::Ok);
    }

    #[test]
    fn what_never_passes_is_refused_until_something_does() {
        let mut sensor = slow();
        for millis in [1000, 1200, 1400] {
            assert_ne!(sensor.at(stamp(millis)), Health::Refused);
            came(&mut sensor, millis);
            sensor.note(Fact::Refused { d2: Some(9.0) }, stamp(millis));
        }
        assert_eq!(sensor.at(stamp(1400)), Health::Refused);
        assert_eq!(sensor.fails_since(), Some(stamp(1000)));
        assert_eq!(sensor.at(stamp(3000)), Health::Stale, "nothing comes");
        came(&mut sensor, 3000);
        sensor.note(PASSED, stamp(3000));
        assert_eq!(sensor.at(stamp(3000)), Health::Ok);
        assert_eq!(sensor.fails_since(), None);
    }

    #[test]
    fn a_repetition_says_nothing() {
        let mut sensor = slow();
        (0..5).for_each(|_| sensor.note(Fact::Repeated, stamp(1000)));
        assert_eq!(sensor.at(stamp(1000)), Health::NeverSeen);
        assert_eq!(sensor.fails_since(), None);
    }

    #[test]
    fn a_slow_source_is_stale_after_its_own_interval_and_not_before() {
        let mut sensor = slow();
        came(&mut sensor, 0);
        for second in 1..30 {
            came(&mut sensor, 2000 * second);
            for millis in 1..=2000 {
                assert_eq!(sensor.at(stamp(2000 * second + millis)), Health::Ok);
            }
        }
        assert_eq!(sensor.at(stamp(58_000 + 5000)), Health::Ok);
        assert_eq!(sensor.at(stamp(58_000 + 5001)), Health::Stale);
    }

    #[test]
    fn an_outage_is_no_interval() {
        let mut sensor = Sensor::new(Patience {
            least: Span::from_millis(100),
            adapts: true,
        });
        (0..10).for_each(|k| came(&mut sensor, 200 * k));
        came(&mut sensor, 3_600_000);
        let after_an_hour = sensor.at(stamp(3_600_000 + 1000));
        assert_eq!(after_an_hour, Health::Stale, "of silence as before");
        // A burst says little, and what is late nothing.
        (0..5).for_each(|_| came(&mut sensor, 3_600_000));
        came(&mut sensor, 3_500_000);
        assert_eq!(sensor.at(stamp(3_600_000 + 400)), Health::Ok);
    }
}
