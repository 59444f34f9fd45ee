//! What the gyro said, in the order of the stamps: which time it covers, and how far it turned.
//!
//! A sample covers the time since the one before or, where that is longer ago than one and a half [`GyroSettings::period`], such a
//! period: what was lost is not made up, the wheels alone tell of that time. A leg that ends between two samples goes on turning as the last of
//! them said; what that was off by, the next sample makes up for: each counts once, over all that it covers. So how far a leg turned is a
//! function of where it begins and ends and of the samples until then, not of how they came, and a sample changes nothing that ended
//! before it. The last one before the history's base stays, because the next one begins where it ended.

use super::places::count_before;
use crate::gyro::GyroSettings;
use crate::kind::{GyroSample, Origin};
use crate::stamp::{Span, Stamp};

/// So many samples of a gyro are kept: a second at 1 kHz, five at 200 Hz.
pub const GYRO_SAMPLES: usize = 1024;

const LAST: usize = GYRO_SAMPLES - 1;
const _: () = assert!(GYRO_SAMPLES.is_power_of_two());

/// The samples, oldest first, in a circle.
#[derive(Clone, Debug)]
pub(crate) struct Turns {
    samples: [GyroSample; GYRO_SAMPLES],
    head: usize,
    len: usize,
}

/// What a gyro measured over a stretch of time.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Turned {
    /// With its bias in it \[rad\].
    pub(crate) angle: f64,
    /// Of its white noise \[rad²\].
    pub(crate) variance: f64,
}

/// Why a sample was not taken in.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum NotTaken {
    Duplicate,
    NoRoom,
}

impl Turns {
    #[allow(clippy::large_stack_arrays)] // Once.
    pub(crate) fn new() -> Self {
        Self {
            samples: [GyroSample::default(); GYRO_SAMPLES],
            head: 0,
            len: 0,
        }
    }

    /// Takes `sample` in.
    pub(crate) fn insert(&mut self, sample: &GyroSample) -> Result<(), NotTaken> {
        let place = self.count(|other| key(other) < key(sample));
        if self.get(place).is_some_and(|it| key(it) == key(sample)) {
            return Err(NotTaken::Duplicate);
        }
        if self.len >= GYRO_SAMPLES {
            return Err(NotTaken::NoRoom);
        }
        for index in (place..self.len).rev() {
            self.samples[self.at(index + 1)] = self.samples[self.at(index)];
        }
        self.samples[self.at(place)] = *sample;
        self.len += 1;
        Ok(())
    }

    /// Forgets what ended before `base` but the last.
    pub(crate) fn forget_before(&mut self, base: Stamp) {
        while self.len > 1 && self.get(1).is_some_and(|second| second.stamp <= base) {
            self.head = self.at(1);
            self.len -= 1;
        }
    }

    /// How far it turned from `from` on, and until when: to the `limit`, or as far as is covered without a gap or, `apart`, by the first
    /// sample; `None` where nothing is covered.
    #[inline]
    pub(crate) fn over(
        &self,
        from: Stamp,
        limit: Stamp,
        apart: bool,
        settings: &GyroSettings,
    ) -> (Stamp, Option<Turned>) {
        let index = self.first_after(from);
        let most = most(settings.period);
        let (mut until, mut turned) = (from, Turned::default());
        let mut last = index.checked_sub(1).and_then(|last| self.get(last));
        for sample in (index..self.len).map(|index| &self.samples[self.at(index)]) {
            if sample.stamp > limit {
                break;
            }
            let begins = begins(sample.stamp, last, settings.period, most);
            if begins > until {
                let end = if until > from { until } else { begins };
                return (end, (until > from).then_some(turned));
            }
            turned.add(sample, sample.stamp - until, settings);
            if let Some(last) = last.filter(|last| last.stamp == begins && begins < until) {
                // Meanwhile the legs before have turned by that one.
                let early = (until - begins).as_seconds();
                turned.angle += (sample.rate_radps - last.rate_radps) * early;
            }
            (until, last) = (sample.stamp, Some(sample));
            if apart {
                return (until, Some(turned));
            }
        }
        match last {
            Some(last) if limit - last.stamp <= most => {
                turned.add(last, limit - until, settings);
                (limit, Some(turned))
            }
            _ if until > from => (until, Some(turned)),
            _ => (limit, None),
        }
    }

    /// The rate at `stamp` and the density of its noise, of the last sample up to then that is no older than it may be for the next one to follow.
    pub(crate) fn latest(&self, stamp: Stamp, settings: &GyroSettings) -> Option<[f64; 2]> {
        let sample = self.get(self.first_after(stamp).checked_sub(1)?)?;
        let is_fresh = stamp - sample.stamp <= most(settings.period);
        is_fresh.then(|| [sample.rate_radps, settings.density(sample.noise)])
    }

    /// The first sample stamped after `stamp`.
    #[inline]
    fn first_after(&self, stamp: Stamp) -> usize {
        self.count(|sample| sample.stamp <= stamp)
    }

    #[inline]
    fn count(&self, is_before: impl Fn(&GyroSample) -> bool) -> usize {
        count_before(self.len, |index| self.get(index).is_some_and(&is_before))
    }

    #[inline]
    fn get(&self, index: usize) -> Option<&GyroSample> {
        (index < self.len).then(|| &self.samples[self.at(index)])
    }

    #[inline]
    fn at(&self, index: usize) -> usize {
        self.head.wrapping_add(index) & LAST
    }
}

impl Turned {
    #[inline]
    fn add(&mut self, sample: &GyroSample, span: Span, settings: &GyroSettings) {
        let dt_s = span.as_seconds();
        let angle = sample.rate_radps * dt_s;
        self.angle += angle;
        self.variance +=
            settings.density(sample.noise) * dt_s + settings.noise_per_turn * angle.abs();
    }
}

/// Where what a sample covers begins, `last` the one before it.
#[inline]
fn begins(stamp: Stamp, last: Option<&GyroSample>, period: Span, most: Span) -> Stamp {
    match last {
        Some(last) if stamp - last.stamp <= most => last.stamp,
        _ => stamp - period,
    }
}

/// From one sample to the next, at most.
#[inline]
fn most(period: Span) -> Span {
    Span::from_nanos(period.as_nanos().saturating_mul(3) / 2)
}

fn key(sample: &GyroSample) -> (Stamp, Origin) {
    (sample.stamp, sample.origin)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: GyroSettings = GyroSettings {
        period: Span::from_nanos(20),
        ..GyroSettings::ORDINARY
    };

    fn ns(nanos: i64) -> Stamp {
        Stamp::from_nanos(nanos)
    }

    fn of(stamp: i64, rate: f64) -> GyroSample {
        GyroSample {
            stamp: ns(stamp),
            rate_radps: 1e9 * rate, // Per nanosecond.
            ..GyroSample::default()
        }
    }

    fn turns(samples: &[(i64, f64)]) -> Turns {
        let mut turns = Turns::new();
        for &(stamp, rate) in samples {
            assert!(turns.insert(&of(stamp, rate)).is_ok());
        }
        turns
    }

    fn over(turns: &Turns, from: i64, limit: i64) -> (i64, Option<f64>) {
        let (until, turned) = turns.over(ns(from), ns(limit), false, &SETTINGS);
        (
            until.as_nanos(),
            turned.map(|it| libm::rint(1e6 * it.angle) / 1e6),
        )
    }

    #[test]
    fn a_sample_turns_since_the_one_before_and_no_longer_than_a_period_if_one_was_lost() {
        let turns = turns(&[(110, 2.0), (100, 1.0), (200, 3.0)]);
        assert_eq!(over(&turns, 60, 300), (80, None));
        assert_eq!(over(&turns, 80, 300), (110, Some(40.0)));
        assert_eq!(over(&turns, 110, 300), (180, None));
        assert_eq!(over(&turns, 180, 205), (205, Some(75.0)));
        assert_eq!(over(&turns, 180, 300), (200, Some(60.0)));
        assert_eq!(over(&turns, 200, 300), (300, None));
        let (until, turned) = turns.over(ns(80), ns(300), true, &SETTINGS);
        assert_eq!((until, turned.map(|it| it.angle)), (ns(100), Some(20.0)));
    }

    #[test]
    fn what_ends_between_two_samples_goes_on_turning_and_depends_on_none_that_is_later() {
        let turns = turns(&[(100, 1.0), (110, 2.0), (200, 3.0)]);
        assert_eq!(over(&turns, 95, 105), (105, Some(10.0)));
        assert_eq!(over(&turns, 105, 112), (112, Some(19.0)));
        assert_eq!(over(&turns, 95, 112), (112, Some(10.0 + 19.0)));
        assert_eq!(over(&turns, 112, 140), (140, Some(56.0)));
        assert_eq!(over(&turns, 112, 141), (141, None));
        assert_eq!(over(&turns, 185, 205), (205, Some(60.0)));
        assert_eq!(over(&turns, 95, 141), (110, Some(25.0)));
        assert_eq!(over(&turns, 60, 79), (79, None));
    }

    #[test]
    fn a_sample_comes_once_and_two_of_one_stamp_count_as_one() {
        let mut turns = turns(&[(100, 1.0), (110, 2.0)]);
        assert_eq!(turns.insert(&of(100, 0.0)), Err(NotTaken::Duplicate));
        let mut other = of(100, 5.0);
        other.origin.sequence = 1;
        assert_eq!(turns.insert(&other), Ok(()));
        assert_eq!(over(&turns, 90, 110), (110, Some(30.0)));
    }

    #[test]
    fn what_is_after_the_base_is_the_same_once_it_has_moved() {
        let mut turns = turns(&[(100, 1.0), (110, 2.0), (120, 3.0)]);
        let before = over(&turns, 115, 130);
        turns.forget_before(ns(115));
        assert_eq!((over(&turns, 115, 130), turns.len), (before, 2));
        turns.forget_before(ns(500));
        assert_eq!(turns.len, 1);
        assert_eq!(turns.insert(&of(130, 0.0)), Ok(()));
    }

    #[test]
    fn the_circle_is_filled_and_no_more() {
        let mut turns = turns(&[(1, 0.0), (2, 0.0)]);
        turns.forget_before(ns(2));
        for stamp in 3..2 + 1024 {
            assert!(turns.insert(&of(stamp, 0.0)).is_ok());
        }
        let full = turns.insert(&of(5000, 0.0));
        assert_eq!(full, Err(NotTaken::NoRoom));
        assert!(
            (2..1026)
                .all(|stamp| turns.first_after(ns(stamp)) == usize::try_from(stamp - 1).unwrap())
        );
    }
}
