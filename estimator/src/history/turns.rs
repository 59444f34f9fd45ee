//! What the gyro said, in the order of the stamps: which time it covers, and how far it turned.
//!
//! A sample covers the time since the one before or, where that is longer ago than one and a half [`GyroSettings::period`], such a
//! period: what was lost is not made up, the wheels alone tell of that time. A leg that ends between two samples goes on turning as the last of
//! them said; what that was off by, the next sample makes up for: each counts once, over all that it covers. So how far a leg turned is a
//! function of where it begins and ends and of the samples until then, not of how they came, and a sample changes nothing that ended
//! before it. The last ones before the history's base stay, because the next one begins where they ended.
//!
//! # Wild samples
//!
//! A single sample that parts from the wheels and from its own neighbours in time is noise of the bus, or a broken sensor: no robot
//! turns so. With m the median of the samples from four before it to four after it, ω the wheels' turn with the gyro's bias, and σ² what wheels and
//! gyro say of one sample together, a rate r is wild where
//!
//! ```text
//! |r − m| > 6 σ        |r − ω| > ½ |r − m|        |r − m| > 3 J, or |m − ω| < ¼ |r − m|
//! ```
//!
//! and where it is more than J from the sample before it or from the one after it; J is the change of rate in a period at
//! 20 rad/s². It counts as m with a noise of `r − m`. Disagreement that lasts is none of one sample: there m is r. A leg knows
//! the samples up to its end alone, so that the verdict of its last four may change in the next one, which makes up for it.

use core::ops::Range;

use super::places::count_before;
use super::storage::Samples;
use crate::gyro::GyroSettings;
use crate::kind::{GyroSample, Origin};
use crate::stamp::{Span, Stamp};

/// So many samples of a gyro should be kept: a second at 1 kHz, five at 200 Hz.
pub const GYRO_SAMPLES: usize = 1024;

/// The samples, oldest first, in a circle over storage that the caller supplies.
#[derive(Clone, Debug)]
pub(crate) struct Turns<G> {
    storage: G,
    /// So many of its places are used: a power of two, or none.
    capacity: usize,
    head: usize,
    len: usize,
    /// None that is later is far from the one before it.
    smooth_from: Stamp,
}

/// What a gyro measured over a stretch of time.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Turned {
    /// With its bias in it \[rad\].
    pub(crate) angle: f64,
    /// Of its white noise \[rad²\].
    pub(crate) variance: f64,
    /// So many more samples are known to be wild.
    pub(crate) wild: i32,
}

/// What the wheels expect a gyro to read.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Expected {
    /// With its bias in it \[rad/s\]; `None`: they say nothing.
    pub(crate) rate: Option<f64>,
    /// Density of the noise of that \[rad²/s\].
    pub(crate) density: f64,
}

/// A sample is looked at beside so many on either side.
const BESIDE: usize = 4;

/// So many of those before the base are kept: what is looked at of the last ones.
const KEPT: usize = 2 * BESIDE;

/// A robot turns faster by no more \[rad/s²\] …
const JOLT: f64 = 20.0;

/// … in so many periods of which the wheels do not know.
const UNSEEN: f64 = 3.0;

/// 6 σ of a sample.
const WILD: f64 = 36.0;

/// Why a sample was not taken in.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum NotTaken {
    Duplicate,
    NoRoom,
}

impl<G: Samples> Turns<G> {
    pub(crate) fn new(storage: G) -> Self {
        let capacity = match storage.as_ref().len().checked_ilog2() {
            Some(exponent) => 1 << exponent,
            None => 0,
        };
        Self {
            storage,
            capacity,
            head: 0,
            len: 0,
            smooth_from: Stamp::from_nanos(i64::MIN),
        }
    }

    /// Takes `sample` in.
    pub(crate) fn insert(
        &mut self,
        sample: &GyroSample,
        settings: &GyroSettings,
    ) -> Result<(), NotTaken> {
        let place = self.count(|other| key(other) < key(sample));
        if self.get(place).is_some_and(|it| key(it) == key(sample)) {
            return Err(NotTaken::Duplicate);
        }
        if self.len >= self.capacity {
            return Err(NotTaken::NoRoom);
        }
        for index in (place..self.len).rev() {
            if let Some(later) = self.get(index).copied() {
                self.put(index + 1, later);
            }
        }
        self.put(place, *sample);
        self.len += 1;
        let jolt = jolt(settings);
        for beside in [place.checked_sub(1), Some(place + 1)] {
            let Some(other) = beside.and_then(|it| self.get(it)) else {
                continue;
            };
            if (sample.rate_radps - other.rate_radps).abs() > jolt {
                self.smooth_from = self.smooth_from.max(sample.stamp).max(other.stamp);
            }
        }
        Ok(())
    }

    /// The sample is far from the one before it.
    fn is_jump(&self, index: usize, jolt: f64) -> bool {
        let before = index.checked_sub(1).and_then(|before| self.get(before));
        let both = before.zip(self.get(index));
        both.is_some_and(|(before, it)| (it.rate_radps - before.rate_radps).abs() > jolt)
    }

    /// Forgets what ended before `base` but the last ones.
    pub(crate) fn forget_before(&mut self, base: Stamp) {
        let kept = KEPT.min(self.capacity / 2).max(1);
        while self.get(kept).is_some_and(|it| it.stamp <= base) {
            self.head = self.at(1);
            self.len -= 1;
        }
    }

    /// How far it turned from `from` on, and until when: to the `limit`, or as far as is covered without a gap or, `apart`, by the first
    /// sample; `None` where nothing is covered. All samples count as they are.
    #[inline]
    pub(crate) fn over(
        &self,
        from: Stamp,
        limit: Stamp,
        apart: bool,
        settings: &GyroSettings,
    ) -> (Stamp, Option<Turned>) {
        let index = self.first_after(from);
        let last = index.checked_sub(1).and_then(|last| self.get(last));
        let samples = (index..self.len).map_while(|index| self.get(index).copied());
        pass(samples, last.copied(), [from, limit], apart, settings)
    }

    /// Whether one of the samples that count from `from` on may be wild.
    #[inline]
    pub(crate) fn is_suspect(&self, from: Stamp, settings: &GyroSettings) -> bool {
        from <= self.smooth_from + most(settings.period)
    }

    /// [`Self::over`] a time that is covered, without what is wild.
    #[cold]
    pub(crate) fn over_tamed(
        &self,
        [from, until]: [Stamp; 2],
        expected: &Expected,
        settings: &GyroSettings,
    ) -> Option<Turned> {
        let index = self.first_after(from);
        let now = self.first_after(until);
        let tamed = |index: usize, known: usize| self.tamed(index, known, expected, settings);
        let mut wild = 0;
        let samples = (index..now).map_while(|index| {
            let (sample, is_wild) = tamed(index, now)?;
            wild += i32::from(is_wild);
            Some(sample)
        });
        let last = index.checked_sub(1).and_then(|last| tamed(last, index));
        let last = last.map(|(sample, _)| sample);
        let (_, turned) = pass(samples, last, [from, until], false, settings);
        let mut turned = turned?;
        turned.wild = wild;
        for before in index.saturating_sub(BESIDE)..index {
            let Some(((was, was_wild), (is, is_wild))) =
                tamed(before, index).zip(tamed(before, now))
            else {
                continue;
            };
            let late = (is.rate_radps - was.rate_radps) * self.span_s(before, settings);
            turned.angle += late;
            turned.variance += late * late;
            turned.wild += i32::from(is_wild) - i32::from(was_wild);
        }
        Some(turned)
    }

    /// The sample as it counts for whoever knows those before `known`, and whether it is wild.
    #[cold]
    fn tamed(
        &self,
        index: usize,
        known: usize,
        expected: &Expected,
        settings: &GyroSettings,
    ) -> Option<(GyroSample, bool)> {
        let sample = *self.get(index)?;
        let (own, rate) = (settings.density(sample.noise), sample.rate_radps);
        let period_s = settings.period.as_seconds();
        let white = WILD * (own + expected.density) / period_s;
        let jolt = jolt(settings);
        // Half of what is wild at least.
        let parts = |least: f64| {
            let apart = expected.rate.map(|it| 2.0 * (rate - it));
            apart.is_none_or(|it| it * it > least * least)
        };
        let jumps =
            self.is_jump(index, jolt) || (index + 1 < known && self.is_jump(index + 1, jolt));
        if !jumps || !parts(libm::sqrt(white)) {
            return Some((sample, false));
        }
        let first = index.saturating_sub(BESIDE);
        let middle = self.middle(first..known.min(index + BESIDE + 1));
        let off = rate - middle;
        let agree = expected
            .rate
            .is_some_and(|it| 4.0 * (middle - it).abs() < off.abs());
        let is_far = off * off > white && (agree || off.abs() > UNSEEN * jolt);
        if !is_far || !parts(off) {
            return Some((sample, false));
        }
        let tame = GyroSample {
            rate_radps: middle,
            noise: own + off * off * period_s,
            ..sample
        };
        Some((tame, true))
    }

    /// The median of their rates, at most [`BESIDE`] on either side of one.
    fn middle(&self, indices: Range<usize>) -> f64 {
        let mut rates = [0.0; 2 * BESIDE + 1];
        let mut count = 0;
        let samples = indices.map_while(|index| self.get(index));
        for (rate, sample) in rates.iter_mut().zip(samples) {
            *rate = sample.rate_radps;
            count += 1;
        }
        let rates = rates.get_mut(..count).unwrap_or_default();
        rates.sort_unstable_by(f64::total_cmp);
        rates.get(count / 2).copied().unwrap_or_default()
    }

    /// What a sample covers \[s\].
    fn span_s(&self, index: usize, settings: &GyroSettings) -> f64 {
        let last = index.checked_sub(1).and_then(|last| self.get(last));
        let Some(sample) = self.get(index) else {
            return 0.0;
        };
        let (period, most) = (settings.period, most(settings.period));
        (sample.stamp - begins(sample.stamp, last, period, most)).as_seconds()
    }

    /// The rate at `stamp` and the density of its noise, of the last sample up to then that is no older than it may be for the next one to follow.
    pub(crate) fn latest(&self, stamp: Stamp, settings: &GyroSettings) -> Option<[f64; 2]> {
        let known = self.first_after(stamp);
        let last = known.checked_sub(1)?;
        let mut sample = *self.get(last)?;
        if self.is_suspect(sample.stamp, settings) {
            (sample, _) = self.tamed(last, known, &Expected::default(), settings)?;
        }
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
        if index >= self.len {
            return None;
        }
        self.storage.as_ref().get(self.at(index))
    }

    #[inline]
    fn put(&mut self, index: usize, sample: GyroSample) {
        let at = self.at(index);
        if let Some(place) = self.storage.as_mut().get_mut(at) {
            *place = sample;
        }
    }

    #[inline]
    fn at(&self, index: usize) -> usize {
        self.head.wrapping_add(index) & self.capacity.wrapping_sub(1)
    }
}

/// The samples from the first after `from` on, the `last` one before them: how far they turn, and until when.
#[inline]
fn pass(
    samples: impl Iterator<Item = GyroSample>,
    mut last: Option<GyroSample>,
    [from, limit]: [Stamp; 2],
    apart: bool,
    settings: &GyroSettings,
) -> (Stamp, Option<Turned>) {
    let most = most(settings.period);
    let (mut until, mut turned) = (from, Turned::default());
    for sample in samples {
        if sample.stamp > limit {
            break;
        }
        let begins = begins(sample.stamp, last.as_ref(), settings.period, most);
        if begins > until {
            let end = if until > from { until } else { begins };
            return (end, (until > from).then_some(turned));
        }
        turned.add(&sample, sample.stamp - until, settings);
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
            turned.add(&last, limit - until, settings);
            (limit, Some(turned))
        }
        _ if until > from => (until, Some(turned)),
        _ => (limit, None),
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

/// A robot's rate changes by no more from one sample to the next \[rad/s\].
#[inline]
fn jolt(settings: &GyroSettings) -> f64 {
    JOLT * settings.period.as_seconds()
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

    const PLACES: usize = 9;

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

    /// The storage's end is never used.
    fn turns(samples: &[(i64, f64)]) -> Turns<[GyroSample; PLACES]> {
        let mut turns = Turns::new([GyroSample::default(); PLACES]);
        for &(stamp, rate) in samples {
            assert!(turns.insert(&of(stamp, rate), &SETTINGS).is_ok());
        }
        turns
    }

    fn over(turns: &Turns<[GyroSample; PLACES]>, from: i64, limit: i64) -> (i64, Option<f64>) {
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
        assert_eq!(
            turns.insert(&of(100, 0.0), &SETTINGS),
            Err(NotTaken::Duplicate)
        );
        let mut other = of(100, 5.0);
        other.origin.sequence = 1;
        assert_eq!(turns.insert(&other, &SETTINGS), Ok(()));
        assert_eq!(over(&turns, 90, 110), (110, Some(30.0)));
    }

    #[test]
    fn what_is_after_the_base_is_the_same_once_it_has_moved() {
        let mut turns = turns(&[(100, 1.0), (110, 2.0), (120, 3.0)]);
        for stamp in [90, 80, 70, 60] {
            assert_eq!(turns.insert(&of(stamp, 4.0), &SETTINGS), Ok(()));
        }
        let before = over(&turns, 115, 130);
        turns.forget_before(ns(115));
        assert_eq!((over(&turns, 115, 130), turns.len), (before, 5));
        turns.forget_before(ns(500));
        assert_eq!(turns.len, 4);
        assert_eq!(turns.insert(&of(130, 0.0), &SETTINGS), Ok(()));
    }

    #[test]
    fn the_circle_is_filled_and_no_more() {
        let mut turns = turns(&[(1, 0.0), (2, 0.0), (3, 0.0), (4, 0.0), (5, 0.0)]);
        turns.forget_before(ns(5));
        for stamp in 6..10 {
            assert!(turns.insert(&of(stamp, 0.0), &SETTINGS).is_ok());
        }
        let full = turns.insert(&of(5000, 0.0), &SETTINGS);
        assert_eq!(full, Err(NotTaken::NoRoom));
        assert!(
            (2..10)
                .all(|stamp| turns.first_after(ns(stamp)) == usize::try_from(stamp - 1).unwrap())
        );
    }

    #[test]
    fn without_storage_there_is_no_room_and_nothing_turns() {
        let mut turns = Turns::new([]);
        assert_eq!(turns.insert(&of(1, 1.0), &SETTINGS), Err(NotTaken::NoRoom));
        turns.forget_before(ns(5));
        let nothing = turns.over(ns(0), ns(10), false, &SETTINGS);
        assert_eq!(nothing, (ns(10), None));
        assert_eq!(turns.latest(ns(10), &SETTINGS), None);
    }
}
