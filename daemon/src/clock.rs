//! Three clocks read as one, and the kernel's frame stamps carried over to the configured one.
//!
//! Deadlines and durations are of `CLOCK_MONOTONIC`, which never steps. The kernel stamps frames with
//! `CLOCK_REALTIME`, which does. Stamps of measurements and estimates are of the configured clock.

use coloc_estimator::{Span, Stamp};
use rustix::time::{ClockId, DynamicClockId, Timespec, clock_gettime, clock_gettime_dynamic};

use crate::config::{Clock, ClockSource, nanos as to_nanos};

/// Where the time comes from; tests bring their own.
pub trait TimeSource: Send {
    /// All clocks at one moment.
    fn read(&self) -> Reading;

    /// `CLOCK_MONOTONIC` alone \[ns\].
    fn monotonic_ns(&self) -> i64 {
        self.read().monotonic_ns
    }
}

/// All clocks at one moment.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// `CLOCK_MONOTONIC`
    pub monotonic_ns: i64,
    /// `CLOCK_REALTIME`
    pub realtime_ns: i64,
    /// `CLOCK_TAI`
    pub tai_ns: i64,
}

/// The kernel's clocks, which are read through the vDSO, mostly without a system call.
#[derive(Copy, Clone, Debug, Default)]
pub struct KernelTime;

impl TimeSource for KernelTime {
    fn read(&self) -> Reading {
        let mut best = Bracketed::read();
        for _ in 1..READ_ATTEMPTS {
            if best.width_ns <= ONE_MOMENT_NS {
                break;
            }
            best = best.narrower(Bracketed::read());
        }
        best.reading
    }

    fn monotonic_ns(&self) -> i64 {
        nanos(clock_gettime(ClockId::Monotonic))
    }
}

/// Clocks read within so little time were read at one moment \[ns\].
const ONE_MOMENT_NS: i64 = 200_000;
const READ_ATTEMPTS: usize = 5;

/// A reading, and how long it took: who is interrupted between two clocks would take one of them to have been stepped.
struct Bracketed {
    reading: Reading,
    width_ns: i64,
}

impl Bracketed {
    fn read() -> Self {
        let monotonic_ns = nanos(clock_gettime(ClockId::Monotonic));
        let realtime_ns = nanos(clock_gettime(ClockId::Realtime));
        // Every kernel since 3.10 has it.
        let tai_ns = clock_gettime_dynamic(DynamicClockId::Tai).map_or(realtime_ns, nanos);
        let width_ns = nanos(clock_gettime(ClockId::Monotonic)) - monotonic_ns;
        let reading = Reading {
            monotonic_ns,
            realtime_ns,
            tai_ns,
        };
        Self { reading, width_ns }
    }

    fn narrower(self, other: Self) -> Self {
        if other.width_ns < self.width_ns {
            other
        } else {
            self
        }
    }
}

fn nanos(time: Timespec) -> i64 {
    time.tv_sec
        .saturating_mul(1_000_000_000)
        .saturating_add(time.tv_nsec)
}

impl Reading {
    /// The configured clock \[ns\].
    #[must_use]
    pub fn of(&self, source: ClockSource) -> i64 {
        match source {
            ClockSource::Realtime => self.realtime_ns,
            ClockSource::Tai => self.tai_ns,
            ClockSource::Monotonic => self.monotonic_ns,
        }
    }
}

/// A thread that is not a real-time one may be held up for so long between reading the clocks and draining a bus.
const SLACK_NS: i64 = 100_000_000;

/// Follows the clocks from tick to tick and notices when one was stepped.
#[derive(Clone, Debug)]
pub struct Timeline {
    source: ClockSource,
    step: i64,
    last: Reading,
}

/// A tick's moment.
#[derive(Copy, Clone, Debug)]
pub struct Moment {
    /// All clocks.
    pub reading: Reading,
    /// The tick's stamp: the configured clock.
    pub stamp: Stamp,
    /// How far the configured clock was stepped since the tick before; zero if it was not.
    pub shift: Span,
    /// Whether the clock of the kernel's frame stamps was stepped since the tick before.
    pub frames_unreliable: bool,
    /// A frame that is read now cannot be older than this: the reads before left none behind.
    earliest: i64,
    latest: i64,
    /// Configured clock minus `CLOCK_REALTIME`: as it is now, and from the last tick's clocks, which differ after a step.
    offsets: [i64; 2],
}

impl Timeline {
    /// Starts at `now`.
    #[must_use]
    pub fn new(clock: &Clock, now: Reading) -> Self {
        let step = to_nanos(clock.step_s);
        Self {
            source: clock.source,
            step,
            last: now,
        }
    }

    /// The moment of the tick that begins at `now`.
    pub fn advance(&mut self, now: Reading) -> Moment {
        let last = self.last;
        let elapsed = now.monotonic_ns - last.monotonic_ns;
        let stepped = |now: i64, last: i64| now.saturating_sub(last).saturating_sub(elapsed);
        let shift = stepped(now.of(self.source), last.of(self.source));
        let kernel_shift = stepped(now.realtime_ns, last.realtime_ns);
        let stamp = now.of(self.source);
        self.last = now;
        Moment {
            reading: now,
            stamp: Stamp::from_nanos(stamp),
            shift: Span::from_nanos(if shift.abs() > self.step { shift } else { 0 }),
            frames_unreliable: kernel_shift.abs() > self.step,
            earliest: stamp.saturating_sub(elapsed).saturating_sub(SLACK_NS),
            latest: stamp.saturating_add(SLACK_NS),
            offsets: [
                stamp.saturating_sub(now.realtime_ns),
                stamp.saturating_sub(last.realtime_ns.saturating_add(elapsed)),
            ],
        }
    }
}

impl Moment {
    /// The configured clock when the kernel received a frame, from the kernel's own stamp.
    ///
    /// If the clock was stepped since the last tick, the frame's stamp is of the clock before or after that: only one of
    /// them puts it where it can have come. If neither does, the time of this read takes its place.
    #[must_use]
    pub fn of_frame(&self, kernel_ns: i64) -> i64 {
        let plausible = |stamp: &i64| (self.earliest..=self.latest).contains(stamp);
        let readings = self.offsets.map(|offset| kernel_ns.saturating_add(offset));
        let stamp = readings.into_iter().find(plausible);
        stamp.unwrap_or(self.stamp.as_nanos())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    fn reading(monotonic: i64, realtime: i64) -> Reading {
        Reading {
            monotonic_ns: monotonic,
            realtime_ns: realtime,
            tai_ns: realtime + 37 * SECOND,
        }
    }

    fn timeline(source: ClockSource) -> Timeline {
        Timeline::new(
            &Clock {
                source,
                ..Clock::default()
            },
            reading(SECOND, 1000 * SECOND),
        )
    }

    #[test]
    fn a_frame_keeps_its_distance_to_the_read() {
        for source in [
            ClockSource::Realtime,
            ClockSource::Tai,
            ClockSource::Monotonic,
        ] {
            let now = reading(SECOND + 20_000_000, 1000 * SECOND + 20_000_000);
            let moment = timeline(source).advance(now);
            assert_eq!(
                moment.of_frame(now.realtime_ns - 3_000_000),
                now.of(source) - 3_000_000
            );
            assert_eq!(
                (moment.shift, moment.frames_unreliable),
                (Span::ZERO, false)
            );
        }
    }

    #[test]
    fn a_step_of_realtime_does_not_touch_the_monotonic_clock_nor_its_frames() {
        for step in [-3600 * SECOND, -SECOND, SECOND, 3600 * SECOND] {
            let mut timeline = timeline(ClockSource::Monotonic);
            let before = 1000 * SECOND + 10_000_000; // Received before the step, read after it.
            let moment = timeline.advance(reading(
                SECOND + 20_000_000,
                1000 * SECOND + 20_000_000 + step,
            ));
            assert_eq!((moment.shift, moment.frames_unreliable), (Span::ZERO, true));
            assert_eq!(moment.of_frame(before), SECOND + 10_000_000);
            let after = before + 5_000_000 + step;
            assert_eq!(moment.of_frame(after), SECOND + 15_000_000);
        }
    }

    #[test]
    fn a_step_of_the_configured_clock_is_measured() {
        let mut timeline = timeline(ClockSource::Realtime);
        let moment = timeline.advance(reading(SECOND + 20_000_000, 1020 * SECOND + 20_000_000));
        assert_eq!(moment.shift, Span::from_nanos(20 * SECOND));
        let next = timeline.advance(reading(SECOND + 40_000_000, 1020 * SECOND + 40_000_000));
        assert_eq!((next.shift, next.frames_unreliable), (Span::ZERO, false));
    }

    #[test]
    fn a_frame_stamped_after_a_step_that_was_not_noticed_yet_is_stamped_by_its_read() {
        let now = reading(SECOND + 20_000_000, 1000 * SECOND + 20_000_000);
        let moment = timeline(ClockSource::Realtime).advance(now);
        assert_eq!(moment.of_frame(now.realtime_ns + SECOND), now.realtime_ns);
        assert_eq!(moment.of_frame(now.realtime_ns - SECOND), now.realtime_ns);
    }

    #[test]
    fn slewing_is_no_step() {
        let mut timeline = timeline(ClockSource::Realtime);
        let moment = timeline.advance(reading(SECOND + 20_000_000, 1000 * SECOND + 20_010_000));
        assert_eq!(
            (moment.shift, moment.frames_unreliable),
            (Span::ZERO, false)
        );
    }
}
