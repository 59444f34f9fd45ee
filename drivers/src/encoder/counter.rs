//! A tick counter that wraps, restarts and lies.

use super::count::{Count, Counts};
use super::reject::FrameReject;
use super::tolerance::{Tolerance, seconds};
use super::wrap::WrapWatch;

/// What a count says about the way since the last one.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Reading {
    /// So far, signed \[m\].
    Travelled(f64),
    /// The way is unknown; counting goes on from here.
    Resynchronised(Cause),
}

/// Why a way is unknown.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    /// There was no count before, or the encoder restarted.
    Restart,
    /// So much time has passed that the counter may have wrapped unseen.
    Ambiguous,
    /// It seems to wrap elsewhere than we were told.
    OtherWrap,
}

/// Turns counts into distances. A count that is too far away is refused; if the next ones agree with *that*, the encoder
/// must have restarted, and counting goes on there.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Counter {
    counts: Counts,
    metres_per_count: f64,
    max_speed_mps: f64,
    late_stamp_s: f64,
    restart_counts: u32,
    last: Option<Count>,
    suspect: Option<Suspect>,
    watch: WrapWatch,
}

/// A count that was refused, and how many in a row agreed with one another so far.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
struct Suspect {
    count: Count,
    agreeing: u32,
}

impl Counter {
    pub(super) fn new(
        counts: Counts,
        metres_per_count: f64,
        max_speed_mps: f64,
        tolerance: &Tolerance,
    ) -> Self {
        Self {
            counts,
            metres_per_count,
            max_speed_mps,
            late_stamp_s: tolerance.late_stamp_s,
            restart_counts: tolerance.restart_counts,
            last: None,
            suspect: None,
            watch: WrapWatch::new(counts),
        }
    }

    /// As fast as that a wheel may not be, or frames `longest_s` apart leave in doubt in which direction it turns \[m/s\].
    pub(super) fn limit_mps(counts: Counts, metres_per_count: f64, longest_s: f64) -> f64 {
        counts.number() / 2.0 * metres_per_count.abs() / longest_s
    }

    /// So fast a wheel must be allowed to be, or a single count between frames `longest_s` apart is not believed \[m/s\].
    pub(super) fn least_mps(metres_per_count: f64, longest_s: f64) -> f64 {
        metres_per_count.abs() / longest_s
    }

    /// What `count` says; the first one says where counting starts.
    ///
    /// # Errors
    /// [`FrameReject::OutOfRange`]: it is no count. [`FrameReject::Implausible`]: no robot is that fast.
    pub(super) fn read(&self, count: Count) -> Result<Reading, FrameReject> {
        if !self.counts.contains(count.raw) {
            return Err(FrameReject::OutOfRange);
        }
        let Some(last) = self.last else {
            return Ok(Reading::Resynchronised(Cause::Restart));
        };
        let reach_m = self.reach_m(last, count);
        if reach_m >= self.half_range_m() {
            return Ok(Reading::Resynchronised(Cause::Ambiguous));
        }
        let way_m = self.way_m(last, count);
        if way_m.abs() > reach_m {
            return self.read_against_suspect(last, count);
        }
        if self.watch.doubts(last, count) {
            return Ok(Reading::Resynchronised(Cause::OtherWrap));
        }
        Ok(Reading::Travelled(way_m))
    }

    fn read_against_suspect(&self, last: Count, count: Count) -> Result<Reading, FrameReject> {
        if self.agreeing(count) < self.restart_counts {
            return Err(FrameReject::Implausible);
        }
        let reach = self.reach_m(last, count) / self.metres_per_count.abs();
        Ok(Reading::Resynchronised(
            if self.watch.has_jumped_from(last, reach) {
                Cause::OtherWrap
            } else {
                Cause::Restart
            },
        ))
    }

    /// How many counts in a row agree, this one included.
    fn agreeing(&self, count: Count) -> u32 {
        let agrees = |suspect: &Suspect| {
            self.way_m(suspect.count, count).abs() <= self.reach_m(suspect.count, count)
        };
        self.suspect
            .filter(agrees)
            .map_or(1, |suspect| suspect.agreeing.saturating_add(1))
    }

    /// `count` counts: the next one is measured from it.
    pub(super) fn accept(&mut self, count: Count, reading: Reading) {
        if let Some(last) = self.last {
            match reading {
                Reading::Resynchronised(Cause::Restart) => self.watch.restarted(last),
                Reading::Resynchronised(Cause::Ambiguous) => self.watch.lost(),
                _ => {
                    let steps = self.counts.between(last.raw, count.raw);
                    self.watch.moved(last, count, steps);
                }
            }
        }
        (self.last, self.suspect) = (Some(count), None);
    }

    /// `count` was refused as implausible: if the next ones agree with it, it was right.
    pub(super) fn suspect(&mut self, count: Count) {
        self.suspect = Some(Suspect {
            count,
            agreeing: self.agreeing(count),
        });
    }

    /// Signed distance between two counts, the shorter way round \[m\].
    fn way_m(&self, from: Count, to: Count) -> f64 {
        self.counts.between(from.raw, to.raw) * self.metres_per_count
    }

    /// The farthest that the wheel can have come between two stamps \[m\].
    fn reach_m(&self, from: Count, to: Count) -> f64 {
        let elapsed_s = seconds(to.stamp_ns.saturating_sub(from.stamp_ns).max(0));
        self.max_speed_mps * (elapsed_s + self.late_stamp_s)
    }

    /// From here on forwards and backwards look alike \[m\].
    fn half_range_m(&self) -> f64 {
        self.counts.number() / 2.0 * self.metres_per_count.abs()
    }

    /// What one count is worth \[m\].
    pub(super) fn metres_per_count(&self) -> f64 {
        self.metres_per_count
    }

    /// The most that is plausible \[m/s\].
    pub(super) fn max_speed_mps(&self) -> f64 {
        self.max_speed_mps
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn count(raw: u64, ms: i64) -> Count {
        Count {
            raw,
            stamp_ns: ms * 1_000_000,
        }
    }

    fn started(bits: u32, raw: u64) -> Counter {
        let mut counter = Counter::new(Counts::all(bits), 0.001, 2.0, &Tolerance::default());
        let first = Reading::Resynchronised(Cause::Restart);
        counter.accept(count(raw, 0), first);
        counter
    }

    #[test]
    fn wrapping_loses_nothing_at_any_width_in_either_direction() {
        for bits in [10, 16, 31, 32, 33, 64] {
            let top = u64::MAX >> (64 - bits);
            assert_eq!(
                started(bits, top - 4).read(count(5, 20)),
                Ok(Reading::Travelled(0.010)),
                "{bits} bits"
            );
            assert_eq!(
                started(bits, 5).read(count(top - 4, 20)),
                Ok(Reading::Travelled(-0.010)),
                "{bits} bits"
            );
        }
    }

    #[test]
    fn a_single_jump_is_refused_and_forgotten() {
        let mut counter = started(32, 1000);
        assert_eq!(
            counter.read(count(900_000, 20)),
            Err(FrameReject::Implausible)
        );
        counter.suspect(count(900_000, 20));
        assert_eq!(counter.read(count(1040, 40)), Ok(Reading::Travelled(0.040)));
    }

    #[test]
    fn a_restarted_encoder_is_believed_the_third_time() {
        let mut counter = started(32, 900_000);
        for refused in [count(0, 20), count(20, 40)] {
            assert_eq!(counter.read(refused), Err(FrameReject::Implausible));
            counter.suspect(refused);
        }
        let restarted = Reading::Resynchronised(Cause::Restart);
        assert_eq!(counter.read(count(40, 60)), Ok(restarted));
        counter.accept(count(40, 60), restarted);
        assert_eq!(counter.read(count(60, 80)), Ok(Reading::Travelled(0.020)));
    }

    #[test]
    fn changing_garbage_is_never_believed() {
        let mut counter = started(32, 1000);
        for step in 1..50 {
            let garbage = count(
                u64::from(0x9E37_79B9_u32.wrapping_mul(step)),
                20 * i64::from(step),
            );
            assert_eq!(
                counter.read(garbage),
                Err(FrameReject::Implausible),
                "step {step}"
            );
            counter.suspect(garbage);
        }
    }

    #[test]
    fn a_narrow_counter_is_not_trusted_after_a_gap_in_which_it_could_have_wrapped() {
        // 2^9 mm of half a range are 0.206 s at 2 m/s, less the slack.
        assert_eq!(
            started(10, 0).read(count(100, 200)),
            Ok(Reading::Travelled(0.100))
        );
        assert_eq!(
            started(10, 0).read(count(100, 210)),
            Ok(Reading::Resynchronised(Cause::Ambiguous))
        );
    }

    /// A counter of `number` counts, that many bits wide.
    fn wrapping(bits: u32, number: u64) -> Counts {
        Counts {
            modulus: Some(number),
            range: Some((0, i128::from(number) - 1)),
            ..Counts::all(bits)
        }
    }

    /// Feeds every frame of a drive; the way that was counted \[m\], and how often another wrap was named.
    fn drive(counts: Counts, metres_per_count: f64, raws: impl Iterator<Item = u64>) -> (f64, u32) {
        let mut counter = Counter::new(counts, metres_per_count, 4.0, &Tolerance::default());
        let (mut way_m, mut named) = (0.0, 0);
        for (raw, frame) in raws.zip(0..) {
            let count = count(raw, 20 * frame);
            match counter.read(count) {
                Ok(reading) => {
                    if let Reading::Travelled(step_m) = reading {
                        way_m += step_m;
                    }
                    named += u32::from(reading == Reading::Resynchronised(Cause::OtherWrap));
                    counter.accept(count, reading);
                }
                Err(FrameReject::Implausible) => counter.suspect(count),
                Err(_) => {}
            }
        }
        (way_m, named)
    }

    /// Counts of a wheel that turns by 3 to 5 counts a frame.
    fn turning(number: u64, frames: u64) -> impl Iterator<Item = u64> {
        (0..frames).scan(0, move |count, frame| {
            *count = (*count + 3 + frame * 7919 % 3) % number;
            Some(*count)
        })
    }

    #[test]
    fn a_counter_that_wraps_early_is_counted_right_by_its_modulus() {
        let (way_m, named) = drive(wrapping(8, 251), 0.005, turning(251, 20_000));
        assert_eq!(named, 0);
        assert!((way_m - 0.005 * 4.0 * 19_999.0).abs() < 0.1, "{way_m}");
    }

    #[test]
    fn a_counter_that_wraps_elsewhere_is_named_and_not_believed_there() {
        for (counts, number) in [
            (Counts::all(8), 251),
            (Counts::all(10), 1000),
            (Counts::all(16), 9000),
        ] {
            let frames = 30 * number;
            let (way_m, named) = drive(counts, 0.005, turning(number, frames));
            #[expect(clippy::cast_precision_loss, reason = "small")]
            let truth_m = 0.005 * 4.0 * frames as f64;
            assert!(
                named > 10,
                "{counts:?} wraps at {number}: named {named} times"
            );
            assert!(
                way_m < truth_m * 1.004,
                "{counts:?}: {way_m} m of {truth_m}"
            );
        }
    }

    /// As those above, in two's complement: from its highest count it goes on at its lowest, both being as many.
    fn signed(bits: u32) -> Counts {
        Counts {
            signed: true,
            ..Counts::all(bits)
        }
    }

    #[test]
    fn a_signed_counter_that_wraps_elsewhere_is_named_too() {
        for (bits, most) in [(8, 100), (10, 499), (16, 9000)] {
            let number = 2 * most + 1;
            let raws = turning(number, 30 * number)
                .map(|count| count.wrapping_sub(most) & (u64::MAX >> (64 - bits)));
            let (_, named) = drive(signed(bits), 0.005, raws);
            assert!(
                named > 10,
                "{bits} bits wrap at {most}: named {named} times"
            );
        }
        for bits in [8, 10, 16] {
            let raws = turning(1 << bits, 40 << bits);
            assert_eq!(drive(signed(bits), 0.005, raws).1, 0, "{bits} bits");
        }
    }

    #[test]
    fn a_counter_that_wraps_where_it_should_is_never_named() {
        for bits in [8, 10, 16] {
            let number = 1 << bits;
            for step in [1, 4, 16] {
                let steady = (0..40 * number).map(move |frame| frame * step % number);
                assert_eq!(
                    drive(Counts::all(bits), 0.005, steady).1,
                    0,
                    "{bits} bits, {step} a frame"
                );
            }
            assert_eq!(
                drive(Counts::all(bits), 0.005, turning(number, 40 * number)).1,
                0
            );
        }
    }

    #[test]
    fn an_encoder_that_restarts_is_not_one_that_wraps() {
        let restarts = [5000, 3000, 8000, 200];
        let raws = restarts
            .into_iter()
            .flat_map(|frames| (0..frames).map(|frame| 4 * frame));
        assert_eq!(drive(Counts::all(32), 0.001, raws).1, 0);
    }

    #[test]
    fn what_is_no_count_is_refused_and_costs_nothing() {
        let mut counter = Counter::new(wrapping(16, 65_535), 0.001, 2.0, &Tolerance::default());
        counter.accept(count(1000, 0), Reading::Resynchronised(Cause::Restart));
        for frame in 1..100 {
            assert_eq!(
                counter.read(count(65_535, 20 * frame)),
                Err(FrameReject::OutOfRange)
            );
        }
        assert_eq!(counter.read(count(2000, 2000)), Ok(Reading::Travelled(1.0)));
    }

    proptest! {
        #[test]
        fn any_walk_is_counted_as_a_model_without_wraps_counts_it(
            number in 100_u64..2000, start in any::<u64>(), signed: bool,
            steps in proptest::collection::vec(-30_i64..=30, 1..200),
        ) {
            let counts = Counts { signed, modulus: Some(number), ..Counts::all(12) };
            let lowest = if signed { -(number.cast_signed() / 2) } else { 0 };
            let raw = |position: i64| {
                let value = position.rem_euclid(number.cast_signed()) + lowest;
                value.cast_unsigned() & 0xFFF
            };
            let mut counter = Counter::new(counts, 1.0, 1e4, &Tolerance::default());
            let mut position = (start % number).cast_signed();
            counter.accept(count(raw(position), 0), Reading::Resynchronised(Cause::Restart));
            for (step, frame) in steps.into_iter().zip(1..) {
                position += step;
                // So slow that a count never gets half round.
                let next = Count { raw: raw(position), stamp_ns: frame };
                counter.max_speed_mps = 40.0 / counter.late_stamp_s;
                let reading = counter.read(next).unwrap();
                #[expect(clippy::cast_precision_loss, reason = "small")]
                let expected = Reading::Travelled(step as f64);
                prop_assert_eq!(reading, expected);
                counter.accept(next, reading);
            }
        }
    }
}
