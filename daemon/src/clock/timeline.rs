//! The clocks from tick to tick.

use coloc_estimator::Stamp;
use coloc_shm_types::boot;

use super::{FrameTime, Reading, WallClock};
use crate::config::ClockSource;

/// Follows the clocks from tick to tick and notices when one was set.
#[derive(Clone, Debug)]
pub struct Timeline {
    walls: Walls,
    /// The moment before the last time when all buses were empty: whatever is read now came after it.
    emptied_ns: i64,
    last_ns: i64,
    boot: u64,
}

#[derive(Copy, Clone, Debug)]
struct Walls {
    realtime: WallClock,
    tai: WallClock,
}

/// A wall clock was set.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct ClockStep {
    /// Which.
    pub clock: ClockSource,
    /// By how much \[ns\].
    pub by_ns: i64,
}

/// The buses were drained.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Drain {
    /// Until there was nothing left.
    pub emptied: bool,
    /// It began no earlier than this \[ns of the inner clock\], and after the moment before in any case.
    pub not_before_ns: i64,
}

/// A tick's moment.
#[derive(Copy, Clone, Debug)]
pub struct Moment {
    /// The tick's stamp, of the inner clock.
    pub stamp: Stamp,
    /// The step of a wall clock that was found since the tick before.
    pub step: Option<ClockStep>,
    walls: Walls,
    /// Which start of which computer the inner clock is of.
    pub(super) boot: u64,
    /// A frame that is read now came between these two.
    earliest_ns: i64,
    latest_ns: i64,
}

/// The kernel stamps a frame before it delivers it \[ns\].
const DELIVERY_NS: i64 = 2_000_000;

/// How far the reading of a wall clock as the inner one may be off \[ns\].
const CONVERSION_NS: i64 = 500_000;

impl Timeline {
    /// Starts at `now`.
    #[must_use]
    pub fn new(now: &Reading) -> Self {
        Self {
            walls: Walls {
                realtime: WallClock::new(now.realtime_ns, now),
                tai: WallClock::new(now.tai_ns, now),
            },
            emptied_ns: now.boot_ns,
            last_ns: now.boot_ns,
            boot: boot(),
        }
    }

    /// The moment `now`. `drain`: what is known of the last drain before it was read.
    pub fn advance(&mut self, now: &Reading, drain: Drain) -> Moment {
        let earliest_ns = self.emptied_ns;
        let step = self.look(now);
        if drain.emptied {
            self.emptied_ns = drain.not_before_ns.max(self.last_ns);
        }
        self.last_ns = now.boot_ns;
        Moment {
            stamp: Stamp::from_nanos(now.boot_ns),
            step,
            walls: self.walls,
            boot: self.boot,
            earliest_ns: earliest_ns.saturating_sub(DELIVERY_NS),
            latest_ns: now.boot_ns.saturating_add(CONVERSION_NS),
        }
    }

    fn look(&mut self, now: &Reading) -> Option<ClockStep> {
        let Walls { realtime, tai } = &mut self.walls;
        let steps = [
            (
                ClockSource::Realtime,
                realtime.look(now.realtime_ns, now, self.last_ns),
            ),
            (ClockSource::Tai, tai.look(now.tai_ns, now, self.last_ns)),
        ];
        // Who sets the one sets the other too, but for the number of leap seconds.
        let step = steps.into_iter().find(|&(_, by_ns)| by_ns != 0);
        step.map(|(clock, by_ns)| ClockStep { clock, by_ns })
    }
}

impl Moment {
    /// When the kernel received a frame that it stamped `kernel_ns` of `CLOCK_REALTIME`, and that was read just now.
    #[must_use]
    pub fn of_frame(&self, kernel_ns: i64) -> FrameTime {
        let readings = self.walls.realtime.readings(kernel_ns);
        FrameTime::of(readings, |ns| {
            (self.earliest_ns..=self.latest_ns).contains(ns)
        })
    }

    /// The moment that a message calls `stamp_ns` of `clock` \[ns of the inner clock\]; see [`WallClock::of_message`].
    #[must_use]
    pub fn of_message(&self, clock: ClockSource, stamp_ns: i64) -> i64 {
        self.walls
            .get(clock)
            .map_or(stamp_ns, |wall| wall.of_message(stamp_ns, self.latest_ns))
    }

    /// What `clock` says at a moment of the inner clock \[ns\].
    #[must_use]
    pub fn on(&self, clock: ClockSource, inner_ns: i64) -> i64 {
        self.walls
            .get(clock)
            .map_or(inner_ns, |wall| wall.at(inner_ns))
    }
}

impl Walls {
    fn get(&self, clock: ClockSource) -> Option<&WallClock> {
        match clock {
            ClockSource::Realtime => Some(&self.realtime),
            ClockSource::Tai => Some(&self.tai),
            ClockSource::Boottime => None,
        }
    }
}

#[cfg(test)]
impl Drain {
    pub(crate) const UNFINISHED: Self = Self {
        emptied: false,
        not_before_ns: i64::MIN,
    };

    /// When it began is not known.
    pub(crate) const EMPTIED: Self = Self::emptied_after(i64::MIN);

    const fn emptied_after(not_before_ns: i64) -> Self {
        Self {
            emptied: true,
            not_before_ns,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;
    const SECOND: i64 = 1000 * MS;
    const TAI: i64 = 37 * SECOND;

    fn reading(boot_ns: i64, offset_ns: i64) -> Reading {
        Reading {
            boot_ns,
            realtime_ns: boot_ns + offset_ns,
            tai_ns: boot_ns + offset_ns + TAI,
            width_ns: 100,
        }
    }

    /// A moment 20 ms after the start at 1 s, with the clocks of the day set by `step_ns` in between.
    fn moment(step_ns: i64) -> Moment {
        let mut timeline = Timeline::new(&reading(SECOND, 1000 * SECOND));
        timeline.advance(
            &reading(SECOND + 20 * MS, 1000 * SECOND + step_ns),
            Drain::EMPTIED,
        )
    }

    fn settled(moment: &Moment, kernel_ns: i64) -> i64 {
        moment.of_frame(kernel_ns).settle(|| None, i64::MIN)
    }

    #[test]
    fn a_frame_keeps_its_distance_to_the_read() {
        let (moment, now) = (moment(0), 1001 * SECOND + 20 * MS);
        let came = settled(&moment, now - 3 * MS);
        assert!((came - (SECOND + 17 * MS)).abs() <= 50, "{came}");
        assert_eq!(moment.step, None);
    }

    #[test]
    fn a_frame_cannot_have_come_before_the_buses_were_empty_nor_after_now() {
        let (moment, now) = (moment(0), 1001 * SECOND + 20 * MS);
        for off in [-SECOND, -25 * MS, 2 * MS, SECOND] {
            assert_eq!(moment.of_frame(now + off), FrameTime::Unbelievable, "{off}");
        }
    }

    #[test]
    fn buses_that_were_not_emptied_may_hold_older_frames() {
        let mut timeline = Timeline::new(&reading(SECOND, 0));
        for tick in 1..10 {
            timeline.advance(&reading(SECOND + 20 * MS * tick, 0), Drain::UNFINISHED);
        }
        let moment = timeline.advance(&reading(SECOND + 200 * MS, 0), Drain::EMPTIED);
        assert!(matches!(moment.of_frame(SECOND + MS), FrameTime::At(_)));
        let moment = timeline.advance(&reading(SECOND + 220 * MS, 0), Drain::EMPTIED);
        assert_eq!(moment.of_frame(SECOND + MS), FrameTime::Unbelievable);
    }

    #[test]
    fn frames_from_before_and_after_a_step_come_when_they_came() {
        for step_ns in [-3600 * SECOND, -SECOND, SECOND, 3600 * SECOND] {
            let moment = moment(step_ns);
            let step = moment.step.unwrap();
            assert_eq!((step.clock, step.by_ns), (ClockSource::Realtime, step_ns));
            let before = 1001 * SECOND + 10 * MS;
            assert!((settled(&moment, before) - (SECOND + 10 * MS)).abs() <= 50);
            let after = before + 5 * MS + step_ns;
            assert!((settled(&moment, after) - (SECOND + 15 * MS)).abs() <= 50);
        }
    }

    #[test]
    fn after_a_small_step_the_frame_is_where_it_was_due() {
        for step_ns in [-5 * MS, -MS, MS, 5 * MS] {
            let moment = moment(step_ns);
            let due = || Some(SECOND + 10 * MS);
            let before = moment.of_frame(1001 * SECOND + 10 * MS).settle(due, 0);
            let after = moment
                .of_frame(1001 * SECOND + 10 * MS + step_ns)
                .settle(due, 0);
            assert!((before - (SECOND + 10 * MS)).abs() <= 50, "{step_ns}");
            assert!((after - (SECOND + 10 * MS)).abs() <= 50, "{step_ns}");
        }
    }

    /// A computer that slept, and woke with another time of day: of the frames of the next tick none came before it slept.
    #[test]
    fn who_drained_after_a_sleep_takes_no_later_frame_for_one_from_before_it() {
        let (slept_ns, set_ns) = (400 * MS, -380 * MS);
        let woke_ns = SECOND + 20 * MS + slept_ns;
        let mut timeline = Timeline::new(&reading(SECOND, 0));
        timeline.advance(&reading(SECOND + 20 * MS, 0), Drain::EMPTIED);
        let drain = Drain::emptied_after(woke_ns);
        timeline.advance(&reading(woke_ns + MS, set_ns), drain);
        let next = reading(woke_ns + 20 * MS, set_ns);
        let moment = timeline.advance(&next, Drain::EMPTIED);
        let came_ns = woke_ns + 15 * MS;
        let before_it_slept = || Some(SECOND + 40 * MS);
        let frame_ns = moment
            .of_frame(came_ns + set_ns)
            .settle(before_it_slept, i64::MIN);
        assert!((frame_ns - came_ns).abs() <= 50, "{}", frame_ns - came_ns);
    }

    #[test]
    fn leap_seconds_that_come_to_be_known_set_one_clock_alone() {
        let mut timeline = Timeline::new(&reading(SECOND, 0));
        let mut now = reading(SECOND + 20 * MS, 0);
        now.tai_ns += SECOND;
        let moment = timeline.advance(&now, Drain::EMPTIED);
        let step = moment.step.unwrap();
        assert_eq!((step.clock, step.by_ns), (ClockSource::Tai, SECOND));
        assert!((moment.on(ClockSource::Tai, SECOND + 20 * MS) - now.tai_ns).abs() <= 50);
    }

    #[test]
    fn what_is_said_in_a_clock_is_understood_in_it() {
        let moment = moment(0);
        for clock in [
            ClockSource::Realtime,
            ClockSource::Tai,
            ClockSource::Boottime,
        ] {
            let said = moment.on(clock, SECOND + 12 * MS);
            assert_eq!(moment.of_message(clock, said), SECOND + 12 * MS);
        }
    }
}
