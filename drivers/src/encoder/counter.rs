//! A tick counter that wraps, restarts and lies.

use crate::signal::sign_extend;

use super::reject::FrameReject;

/// A count and its stamp.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) struct Count {
    pub(super) raw: u64,
    pub(super) stamp_ns: i64,
}

/// What a count says about the way since the last one.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Reading {
    /// So far, signed \[m\].
    Travelled(f64),
    /// The way is unknown; counting goes on from here.
    Resynchronised,
}

/// Turns counts into distances. A count that is too far away is refused; if the next ones agree with *that*, the encoder
/// must have restarted, and counting goes on there.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Counter {
    bits: u32,
    metres_per_count: f64,
    max_speed_mps: f64,
    last: Option<Count>,
    suspect: Option<Suspect>,
}

/// A count that was refused, and how many in a row agreed with one another so far.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
struct Suspect {
    count: Count,
    agreeing: u32,
}

/// So many counts in a row must agree before they are believed against what was known: a second node on the same
/// identifier gets that many through only if ours falls silent.
const CONVINCING: u32 = 3;

/// A frame may be stamped that much late and the next one in time \[s\].
const STAMP_SLACK_S: f64 = 0.05;

impl Counter {
    pub(super) fn new(bits: u32, metres_per_count: f64, max_speed_mps: f64) -> Self {
        Self {
            bits,
            metres_per_count,
            max_speed_mps,
            last: None,
            suspect: None,
        }
    }

    /// What `count` says; the first one says where counting starts.
    ///
    /// # Errors
    /// [`FrameReject::Implausible`]: no robot is that fast.
    pub(super) fn read(&self, count: Count) -> Result<Reading, FrameReject> {
        let Some(last) = self.last else {
            return Ok(Reading::Resynchronised);
        };
        let reach_m = self.reach_m(last, count);
        if reach_m >= self.half_range_m() {
            return Ok(Reading::Resynchronised);
        }
        let way_m = self.way_m(last, count);
        if way_m.abs() <= reach_m {
            return Ok(Reading::Travelled(way_m));
        }
        self.read_against_suspect(count)
    }

    fn read_against_suspect(&self, count: Count) -> Result<Reading, FrameReject> {
        let convinced = self.agreeing(count) >= CONVINCING;
        if convinced {
            Ok(Reading::Resynchronised)
        } else {
            Err(FrameReject::Implausible)
        }
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
    pub(super) fn accept(&mut self, count: Count) {
        (self.last, self.suspect) = (Some(count), None);
    }

    /// `count` was refused: if the next ones agree with it, it was right.
    pub(super) fn suspect(&mut self, count: Count) {
        self.suspect = Some(Suspect {
            count,
            agreeing: self.agreeing(count),
        });
    }

    /// Forgets what was counted: the next count is the first.
    pub(super) fn restart(&mut self) {
        (self.last, self.suspect) = (None, None);
    }

    /// Signed distance between two counts, the shorter way round \[m\].
    #[expect(
        clippy::cast_precision_loss,
        reason = "distances beyond 2^53 ticks are implausible anyway"
    )]
    fn way_m(&self, from: Count, to: Count) -> f64 {
        let bits = if cfg!(coloc_break = "wrap") {
            u64::BITS
        } else {
            self.bits
        };
        sign_extend(to.raw.wrapping_sub(from.raw), bits) as f64 * self.metres_per_count
    }

    /// The farthest that the wheel can have come between two stamps \[m\].
    #[expect(
        clippy::cast_precision_loss,
        reason = "nanoseconds of a century are within 2^53 microseconds"
    )]
    fn reach_m(&self, from: Count, to: Count) -> f64 {
        let elapsed_s = to.stamp_ns.saturating_sub(from.stamp_ns).max(0) as f64 * 1e-9;
        self.max_speed_mps * (elapsed_s + STAMP_SLACK_S)
    }

    /// From here on forwards and backwards look alike \[m\].
    fn half_range_m(&self) -> f64 {
        f64::from(self.bits - 1).exp2() * self.metres_per_count.abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(raw: u64, ms: i64) -> Count {
        Count {
            raw,
            stamp_ns: ms * 1_000_000,
        }
    }

    fn started(bits: u32, raw: u64) -> Counter {
        let mut counter = Counter::new(bits, 0.001, 2.0);
        counter.accept(count(raw, 0));
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
        assert_eq!(counter.read(count(40, 60)), Ok(Reading::Resynchronised));
        counter.accept(count(40, 60));
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
            Ok(Reading::Resynchronised)
        );
    }
}
