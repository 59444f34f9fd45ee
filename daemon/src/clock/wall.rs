//! A clock that somebody sets, as seen from the one that nobody sets.

use coloc_drivers::is_broken;

use super::Reading;

/// A wall clock, read as the inner clock.
///
/// Its distance from the inner clock is a constant until a reading *proves* that it was set: only then does a new epoch begin.
/// Of the epoch before, the distance is kept, for what was stamped before the step and is read after it.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct WallClock {
    /// Wall clock minus inner clock, as it is used.
    offset_ns: i64,
    /// Where that distance can lie, by all readings of this epoch.
    least_ns: i64,
    most_ns: i64,
    before: Option<Before>,
}

/// The epoch before, and when it ended.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
#[expect(clippy::struct_field_names, reason = "units belong in names")]
struct Before {
    offset_ns: i64,
    /// It had not ended at this moment of the inner clock …
    after_ns: i64,
    /// … and had at this one.
    until_ns: i64,
}

/// Less than this is no step \[ns\]. The kernel's clocks differ by a constant, but not every machine has the kernel's own.
const SLOP_NS: i64 = 100_000;

impl WallClock {
    /// Begins with what `reading` says of the clock.
    #[must_use]
    pub fn new(wall_ns: i64, reading: &Reading) -> Self {
        let most_ns = wall_ns.saturating_sub(reading.boot_ns);
        let least_ns = most_ns.saturating_sub(reading.width_ns);
        Self {
            offset_ns: least_ns.midpoint(most_ns),
            least_ns,
            most_ns,
            before: None,
        }
    }

    /// Looks at the clock again: by how much it was set since `last_ns` of the inner clock, zero if that is not proven.
    pub fn look(&mut self, wall_ns: i64, reading: &Reading, last_ns: i64) -> i64 {
        let now = Self::new(wall_ns, reading);
        let least_ns = self.least_ns.max(now.least_ns);
        let most_ns = self.most_ns.min(now.most_ns);
        if least_ns <= most_ns {
            (self.least_ns, self.most_ns) = (least_ns, most_ns);
            return 0;
        }
        if least_ns.saturating_sub(most_ns) <= SLOP_NS || is_broken("clock_step") {
            return 0;
        }
        let step_ns = now.offset_ns.saturating_sub(self.offset_ns);
        let before = Before {
            offset_ns: self.offset_ns,
            after_ns: last_ns,
            until_ns: reading.boot_ns.saturating_add(reading.width_ns),
        };
        *self = Self {
            before: Some(before),
            ..now
        };
        step_ns
    }

    /// What the wall clock says at a moment of the inner one \[ns\].
    #[must_use]
    pub fn at(&self, inner_ns: i64) -> i64 {
        inner_ns.saturating_add(self.offset_ns)
    }

    /// When the wall clock can have said `wall_ns`, newest epoch first \[ns of the inner clock\].
    ///
    /// A clock that was set back says the same twice: then there are two.
    #[must_use]
    pub fn readings(&self, wall_ns: i64) -> [Option<i64>; 2] {
        let newest = wall_ns.saturating_sub(self.offset_ns);
        let Some(before) = self.before else {
            return [Some(newest), None];
        };
        let older = wall_ns.saturating_sub(before.offset_ns);
        [
            Some(newest).filter(|&ns| ns >= before.after_ns),
            Some(older).filter(|&ns| ns <= before.until_ns),
        ]
    }

    /// The moment that a message calls `wall_ns`, which arrived before `latest_ns` of the inner clock.
    ///
    /// Where there are two, the later one that is not in the future: messages are rather young than old. So a stamp is
    /// misread only if its message was under way for longer than the clock was set back, and then by no more than that.
    #[must_use]
    pub fn of_message(&self, wall_ns: i64, latest_ns: i64) -> i64 {
        let newest = wall_ns.saturating_sub(self.offset_ns);
        let readings = self.readings(wall_ns).into_iter().flatten();
        let arrived = readings.filter(|&ns| ns <= latest_ns);
        arrived.max().unwrap_or(newest)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MS: i64 = 1_000_000;
    const SECOND: i64 = 1000 * MS;

    fn reading(boot_ns: i64, width_ns: i64) -> Reading {
        Reading {
            boot_ns,
            width_ns,
            ..Reading::default()
        }
    }

    fn stepped(step_ns: i64) -> WallClock {
        let mut wall = WallClock::new(1000 * SECOND, &reading(0, 0));
        assert_eq!(
            wall.look(1000 * SECOND + 20 * MS + step_ns, &reading(20 * MS, 0), 0),
            step_ns
        );
        wall
    }

    #[test]
    fn a_wide_bracket_proves_nothing_that_it_does_not_prove() {
        let mut wall = WallClock::new(1000 * SECOND, &reading(0, 0));
        let wide = reading(20 * MS, 5 * MS);
        assert_eq!(wall.look(1000 * SECOND + 25 * MS, &wide, 0), 0);
        assert_eq!(wall.look(1000 * SECOND + 20 * MS, &wide, 0), 0);
        assert_ne!(wall.look(1000 * SECOND + 27 * MS, &wide, 0), 0);
    }

    #[test]
    fn a_message_from_before_a_step_is_read_by_the_clock_of_its_time() {
        for step_ns in [
            -3600 * SECOND,
            -SECOND,
            -30 * MS,
            MS,
            30 * MS,
            3600 * SECOND,
        ] {
            let wall = stepped(step_ns);
            let made_before = 1000 * SECOND + 5 * MS;
            assert_eq!(wall.of_message(made_before, 20 * MS), 5 * MS, "{step_ns}");
            let made_after = 1000 * SECOND + 25 * MS + step_ns;
            assert_eq!(wall.of_message(made_after, 30 * MS), 25 * MS, "{step_ns}");
        }
    }

    #[test]
    fn a_stamp_from_the_future_stays_there() {
        let wall = stepped(-SECOND);
        let future = 1000 * SECOND + 5 * SECOND;
        assert_eq!(wall.of_message(future, 30 * MS), 6 * SECOND);
    }

    proptest! {
        /// However roughly the clocks are read: a clock that is not set has one epoch, and a step of a millisecond is seen.
        #[test]
        fn an_epoch_ends_with_a_step_and_with_nothing_else(
            widths in proptest::collection::vec((0_i64..200_000, 0_i64..200_000), 2..50),
            step_ns in prop_oneof![-3600 * SECOND..=-MS, MS..=3600 * SECOND],
        ) {
            let offset_ns = 1000 * SECOND;
            let read = |tick: i64, (a, b): (i64, i64), offset_ns: i64| {
                let boot_ns = 20 * MS * tick;
                (boot_ns + a.min(b) + offset_ns, reading(boot_ns, a.max(b)))
            };
            let (wall_ns, first) = read(0, widths[0], offset_ns);
            let mut wall = WallClock::new(wall_ns, &first);
            let stamp_ns = offset_ns + 123_456_789;
            let read_as = wall.of_message(stamp_ns, i64::MAX);
            for (tick, &width) in (1..).zip(&widths) {
                let (wall_ns, now) = read(tick, width, offset_ns);
                prop_assert_eq!(wall.look(wall_ns, &now, 0), 0);
                prop_assert_eq!(wall.of_message(stamp_ns, i64::MAX), read_as, "equal stamps stay equal");
            }
            let (wall_ns, now) = read(100, widths[1], offset_ns + step_ns);
            let seen_ns = wall.look(wall_ns, &now, now.boot_ns - 20 * MS);
            prop_assert!((seen_ns - step_ns).abs() <= 200_000, "{seen_ns}");
        }
    }
}
