//! The stamps of messages, read as the inner clock, and the inner clock by its name.

use coloc_shm_types::{Clock, Header};

use super::Moment;
use crate::config::ClockSource;

impl Moment {
    /// The same header with its stamp read as the inner clock. One of a clock that has no meaning is left as it is, and so is one
    /// of `CLOCK_BOOTTIME`, whosever it may be: whether it can be believed is for validation to say.
    #[must_use]
    pub fn inner(&self, header: &Header) -> Header {
        match header.clock() {
            Err(_) | Ok(Clock::Boottime) => *header,
            Ok(clock) => Header {
                stamp_ns: self.of_message(clock.into(), header.stamp_ns),
                clock: Clock::Boottime as u8,
                boot: self.boot,
                ..*header
            },
        }
    }
}

impl From<ClockSource> for Clock {
    fn from(source: ClockSource) -> Self {
        match source {
            ClockSource::Realtime => Self::Realtime,
            ClockSource::Tai => Self::Tai,
            ClockSource::Boottime => Self::Boottime,
        }
    }
}

impl From<Clock> for ClockSource {
    fn from(clock: Clock) -> Self {
        match clock {
            Clock::Realtime => Self::Realtime,
            Clock::Tai => Self::Tai,
            Clock::Boottime => Self::Boottime,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Drain, Reading, Timeline};
    use super::*;
    use coloc_shm_types::boot;

    const SECOND: i64 = 1_000_000_000;

    fn moment() -> Moment {
        let now = Reading {
            boot_ns: SECOND,
            realtime_ns: 1000 * SECOND,
            tai_ns: 1037 * SECOND,
            width_ns: 0,
        };
        Timeline::new(&now).advance(&now, Drain::EMPTIED)
    }

    fn header(clock: u8, stamp_ns: i64) -> Header {
        Header {
            stamp_ns,
            clock,
            session: 5,
            sequence: 6,
            source: 7,
            boot: 8,
            ..Header::default()
        }
    }

    #[test]
    fn a_stamp_of_the_day_becomes_one_of_this_boot_and_all_else_stays() {
        for (clock, now_ns) in [
            (Clock::Realtime, 1000 * SECOND),
            (Clock::Tai, 1037 * SECOND),
        ] {
            let inner = moment().inner(&header(clock as u8, now_ns));
            let expected = Header {
                boot: boot(),
                ..header(0, SECOND)
            };
            assert_eq!(inner, expected);
        }
    }

    #[test]
    fn what_cannot_be_read_is_left_to_validation() {
        for clock in [0, 3, u8::MAX] {
            let raw = header(clock, 1000 * SECOND);
            assert_eq!(moment().inner(&raw), raw);
        }
    }
}
