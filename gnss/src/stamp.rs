//! The stamps of messages.

use coloc_sensors::Moment;
use coloc_sensors::pace::Playback;
use coloc_shm_types::Clock;

use crate::refusal::Refusal;
use crate::section::Stamp;

/// GPS counts 1024 weeks and begins anew: a receiver whose maker did not think of it is off by so much (ns).
const ROLLOVER_NS: i64 = 1024 * 7 * 86_400_000_000_000;

/// Turns the time of a fix into a stamp.
#[derive(Clone, Debug)]
pub struct Stamper {
    how: How,
    latency_ns: i64,
    off_ns: i64,
    /// The computer's clock minus the last fix's time, when it came (ns).
    behind_ns: Option<i64>,
}

#[derive(Clone, Debug)]
enum How {
    /// A receiver's own time, held against the computer's.
    Live,
    /// The time of arrival.
    Arrival,
    /// The time in a recording, as it is.
    Recorded,
    /// A recording that is played now: its first fix is of the moment at which it is read.
    Played(Playback),
}

impl Stamper {
    /// For a receiver.
    #[must_use]
    pub fn live(stamp: Stamp, latency_ns: i64, off_ns: i64) -> Self {
        let how = match stamp {
            Stamp::Fix => How::Live,
            Stamp::Arrival => How::Arrival,
        };
        Self {
            how,
            latency_ns,
            off_ns,
            behind_ns: None,
        }
    }

    /// For a recording, which is `played` as if it were measured now, or else read as what it is.
    #[must_use]
    pub fn recording(played: bool, latency_ns: i64) -> Self {
        let how = if played {
            How::Played(Playback::default())
        } else {
            How::Recorded
        };
        Self {
            how,
            latency_ns,
            off_ns: 0,
            behind_ns: None,
        }
    }

    /// Of which clock the stamps are.
    #[must_use]
    pub fn clock(&self) -> Clock {
        match self.how {
            How::Live | How::Recorded => Clock::Realtime,
            How::Arrival | How::Played(_) => Clock::Boottime,
        }
    }

    /// How far the last fix's time was behind the computer's clock when it came (ns).
    #[must_use]
    pub fn behind_ns(&self) -> Option<i64> {
        self.behind_ns
    }

    /// The stamp of what was measured at `utc_ns` and came at `arrived` (ns).
    ///
    /// # Errors
    /// If it has no time, or one that cannot be.
    pub fn stamp(&mut self, utc_ns: Option<i64>, arrived: Moment) -> Result<i64, Refusal> {
        let measured_ns = match &mut self.how {
            How::Arrival => arrived.boottime_ns,
            How::Recorded => utc_ns.ok_or(Refusal::NoDate)?,
            How::Played(playback) => {
                playback.due_ns(utc_ns.ok_or(Refusal::NoDate)?, arrived.boottime_ns)
            }
            How::Live => {
                let utc_ns = of_this_era(utc_ns.ok_or(Refusal::NoDate)?, arrived.realtime_ns);
                let behind_ns = arrived.realtime_ns.saturating_sub(utc_ns);
                self.behind_ns = Some(behind_ns);
                if behind_ns.saturating_abs() > self.off_ns {
                    return Err(Refusal::Clock);
                }
                utc_ns
            }
        };
        Ok(measured_ns.saturating_sub(self.latency_ns))
    }
}

/// A time that is off by whole eras of GPS, put right by a clock that is about right.
fn of_this_era(utc_ns: i64, now_ns: i64) -> i64 {
    let behind_ns = now_ns.saturating_sub(utc_ns);
    let eras = behind_ns
        .saturating_add(ROLLOVER_NS / 2)
        .div_euclid(ROLLOVER_NS);
    utc_ns.saturating_add(eras.saturating_mul(ROLLOVER_NS))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;
    const NOW: Moment = Moment {
        boottime_ns: 5_000 * SECOND,
        realtime_ns: 1_700_000_000 * SECOND,
    };

    #[test]
    fn a_fix_has_its_own_time_if_the_computers_clock_agrees() {
        let mut live = Stamper::live(Stamp::Fix, SECOND / 10, 2 * SECOND);
        let fix_ns = NOW.realtime_ns - SECOND;
        assert_eq!(live.stamp(Some(fix_ns), NOW), Ok(fix_ns - SECOND / 10));
        assert_eq!(
            (live.clock(), live.behind_ns()),
            (Clock::Realtime, Some(SECOND))
        );
        assert_eq!(
            live.stamp(Some(fix_ns - 2 * SECOND), NOW),
            Err(Refusal::Clock)
        );
        assert_eq!(
            live.stamp(Some(NOW.realtime_ns + 3 * SECOND), NOW),
            Err(Refusal::Clock)
        );
        assert_eq!(live.stamp(None, NOW), Err(Refusal::NoDate));
    }

    #[test]
    fn a_receiver_that_lives_in_another_era_is_understood() {
        let mut live = Stamper::live(Stamp::Fix, 0, SECOND);
        for eras in -2..3 {
            let said = NOW.realtime_ns + eras * ROLLOVER_NS;
            assert_eq!(live.stamp(Some(said), NOW), Ok(NOW.realtime_ns));
        }
    }

    #[test]
    fn a_recording_with_a_gap_goes_on_in_the_present() {
        let mut played = Stamper::recording(true, 0);
        for (second, hours) in (0..8).zip([0, 0, 1, 1, 1, 0, 0, 9]) {
            let arrived = Moment {
                boottime_ns: NOW.boottime_ns + second * SECOND,
                ..NOW
            };
            let utc_ns = (hours * 3600 + second) * SECOND;
            assert_eq!(
                played.stamp(Some(utc_ns), arrived),
                Ok(arrived.boottime_ns),
                "{hours} h"
            );
        }
    }

    #[test]
    fn a_recording_that_is_played_begins_now() {
        let mut played = Stamper::recording(true, 0);
        assert_eq!(played.stamp(Some(7 * SECOND), NOW), Ok(NOW.boottime_ns));
        assert_eq!(
            played.stamp(Some(9 * SECOND), NOW),
            Ok(NOW.boottime_ns + 2 * SECOND)
        );
        assert_eq!(played.clock(), Clock::Boottime);
        let mut read = Stamper::recording(false, 0);
        assert_eq!(read.stamp(Some(7 * SECOND), NOW), Ok(7 * SECOND));
        let mut arrival = Stamper::live(Stamp::Arrival, SECOND, SECOND);
        assert_eq!(arrival.stamp(None, NOW), Ok(NOW.boottime_ns - SECOND));
    }
}
