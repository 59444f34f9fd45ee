//! The way from the base to now, of which most was put together in the ticks before.
//!
//! Time is cut into blocks, the same for everybody. The way of a whole block is kept until a sample comes that changes it; only the
//! legs before the first whole block and after the last are passed one by one. Which are put together first depends on the time
//! alone: the way is the same to the bit whether it was kept or not.

use super::History;
use super::storage::{Samples, Slots};
use crate::found::Stride;
use crate::settings::Settings;
use crate::stamp::{Span, Stamp};

/// Of one block \[ns\].
const LENGTH: i64 = 100_000_000;

/// So many are kept; a longer way goes on leg by leg.
const KEPT: usize = 32;

/// The ways of whole blocks, each in its place.
#[derive(Clone, Debug)]
pub(crate) struct Ways {
    kept: [Option<(Block, Stride)>; KEPT],
    /// None of them ends after this.
    until: Stamp,
}

/// The time after `n · LENGTH` and up to `(n + 1) · LENGTH`.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
struct Block(i64);

impl Block {
    /// The one in which the instant after `stamp` lies.
    fn after(stamp: Stamp) -> Self {
        Self(stamp.as_nanos().div_euclid(LENGTH))
    }

    fn begins(self) -> Stamp {
        Stamp::from_nanos(self.0.saturating_mul(LENGTH))
    }

    fn ends(self) -> Stamp {
        self.begins() + Span::from_nanos(LENGTH)
    }

    fn place(self) -> usize {
        let number = self.0.unsigned_abs() % (KEPT as u64);
        usize::try_from(number).unwrap_or(0)
    }
}

impl Ways {
    /// None yet.
    pub(crate) fn new() -> Self {
        Self {
            kept: [None; KEPT],
            until: Stamp::from_nanos(i64::MIN),
        }
    }

    /// What comes after `stamp` is not as it was.
    #[inline]
    pub(crate) fn forget_after(&mut self, stamp: Stamp) {
        if stamp >= self.until {
            return;
        }
        self.until = stamp;
        for kept in &mut self.kept {
            if kept.is_some_and(|(block, _)| block.ends() > stamp) {
                *kept = None;
            }
        }
    }

    fn of(&self, block: Block) -> Option<&Stride> {
        let (kept, way) = self.kept.get(block.place())?.as_ref()?;
        (*kept == block).then_some(way)
    }

    fn keep(&mut self, block: Block, way: Stride) {
        if let Some(place) = self.kept.get_mut(block.place()) {
            *place = Some((block, way));
            self.until = self.until.max(block.ends());
        }
    }
}

impl<S: Slots, G: Samples> History<S, G> {
    /// Keeps the ways of the whole blocks up to `to`.
    pub(crate) fn keep_ways(&mut self, to: Stamp, settings: &Settings) {
        if settings.gyro().is_some() {
            return; // Its motion depends on the bias at the base.
        }
        for (from, until) in pieces(self.base.stamp, to) {
            let block = Block::after(from);
            if is_whole(from, until) && self.ways.of(block).is_none() {
                let way = self.passed(Stride::NONE, from, until, settings);
                self.ways.keep(block, way);
            }
        }
    }

    /// The way from the base to `to`, as it was measured.
    pub(crate) fn way_to(&self, to: Stamp, settings: &Settings) -> Stride {
        if settings.gyro().is_some() {
            return self.passed(Stride::NONE, self.base.stamp, to, settings);
        }
        let mut way = Stride::NONE;
        for (from, until) in pieces(self.base.stamp, to) {
            if !is_whole(from, until) {
                way = self.passed(way, from, until, settings);
                continue;
            }
            let block = match self.ways.of(Block::after(from)) {
                Some(kept) => *kept,
                None => self.passed(Stride::NONE, from, until, settings),
            };
            way = way.then(&block);
        }
        way
    }

    /// `way`, and then the legs between two stamps.
    fn passed(&self, mut way: Stride, from: Stamp, until: Stamp, settings: &Settings) -> Stride {
        self.each_leg(from, until, settings, |motion, dt_s| {
            way = way.then(&Stride::of(motion, dt_s));
        });
        way
    }
}

/// The time between two stamps, cut where blocks end; the last piece is what is left.
fn pieces(from: Stamp, to: Stamp) -> impl Iterator<Item = (Stamp, Stamp)> {
    let mut begins = from;
    let mut left = KEPT;
    core::iter::from_fn(move || {
        if begins >= to {
            return None;
        }
        let ends = if left > 0 {
            Block::after(begins).ends().min(to)
        } else {
            to
        };
        left = left.saturating_sub(1);
        let piece = (begins, ends);
        begins = ends;
        Some(piece)
    })
}

fn is_whole(from: Stamp, until: Stamp) -> bool {
    let block = Block::after(from);
    block.begins() == from && block.ends() == until
}

#[cfg(test)]
mod tests {
    use super::super::Slot;
    use super::*;
    use crate::belief::Belief;
    use crate::filter::Filter;
    use crate::kind::{GyroSample, Measured, OdometrySample};
    use crate::motion::Motion;
    use crate::settings::OdometrySettings;

    fn settings() -> Settings {
        let odometry = OdometrySettings {
            reference_period: Span::from_millis(20),
            hold: Span::from_millis(200),
            hold_growth: 1.0,
            outage_variance: [0.1, 0.1, 0.1],
        };
        Settings {
            odometry,
            ..Settings::default()
        }
    }

    fn at(ms: i64) -> Stamp {
        Stamp::default() + Span::from_millis(ms)
    }

    type Short = History<[Slot; 24], [GyroSample; 0]>;

    #[allow(clippy::large_stack_arrays)] // Of a test's thread.
    fn history() -> Short {
        let begins = at(-30);
        let filter = Filter::beginning(begins, Belief::default());
        History::new(begins, &filter, ([Slot::default(); 24], []))
    }

    fn hear(history: &mut Short, from: i64, to: i64, velocity: f64) {
        let noise = crate::covariance::Covariance2::diagonal([0.01, 0.02]);
        let sample = OdometrySample {
            source: 0,
            start: at(from),
            stamp: at(to),
            motion: Motion::Nonholonomic {
                velocity: [velocity, 0.3],
                noise: noise.expect("positive"),
            },
        };
        let key = sample.key();
        let place = history.place_of(&key).expect("new");
        assert!(history.insert(place, key, &sample.into()));
    }

    /// Samples come one by one, one of them late, and each time all that can be kept is.
    #[test]
    fn a_way_that_was_kept_is_the_same_to_the_bit() {
        let (mut keeps, mut not) = (history(), history());
        let order = [0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12, 13, 8, 14, 20, 21];
        for k in order {
            let (from, to) = (20 * k, 20 * (k + 1));
            let velocity = 1.0 + 0.1 * f64::from(i32::try_from(k).expect("small"));
            for history in [&mut keeps, &mut not] {
                hear(history, from, to, velocity);
            }
            for now in [at(to), at(to + 37), at(to + 500)] {
                keeps.keep_ways(now, &settings());
                assert_eq!(
                    keeps.way_to(now, &settings()),
                    not.way_to(now, &settings()),
                    "{k}"
                );
            }
        }
        assert!(keeps.ways.of(Block(0)).is_some() && not.ways.of(Block(0)).is_none());
    }

    /// A stamp that is wrong by years costs no more than a few blocks.
    #[test]
    fn a_way_without_end_has_few_pieces() {
        let end = Stamp::from_nanos(i64::MAX / 2);
        assert_eq!(pieces(at(0), end).count(), KEPT + 1);
        assert_eq!(pieces(at(0), end).last().map(|(_, ends)| ends), Some(end));
        assert_eq!(pieces(at(5), at(5)).count(), 0);
    }
}
