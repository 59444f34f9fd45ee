//! Signs that a counter wraps elsewhere than it should.

use super::count::{Count, Counts};
use super::tolerance::{CONVINCING_WRAPS, FEWEST_MISSING_COUNTS};

/// Watches where a counter jumps.
///
/// A counter of ten bits that goes from 999 to 0 seems to make 25 steps there, at every turn, and never shows a count
/// above 999. One of sixteen bits that goes from 9000 to 0 seems to restart, always at the same count.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct WrapWatch {
    /// How many counts there should be; beyond 2^53 nobody will see a wrap.
    number: f64,
    /// Beyond 63 bits nobody will see a wrap, and what two's complement does with a modulus is anybody's guess.
    watches: bool,
    /// The bit that puts the counts of two's complement in their order, lowest first.
    sign: u64,
    /// Of the places that were seen. Counts without a sign begin at zero.
    lowest: u64,
    highest: u64,
    /// Steps per nanosecond, as of the last frames that did not wrap.
    pace: Option<f64>,
    /// It has been in the middle of its counts since the last wrap: this one is another.
    turned: bool,
    /// Wraps in a row that seem too long by just the counts that were never seen.
    early: u32,
    /// Where it was when it last seemed to restart.
    restarted_at: Option<u64>,
}

impl WrapWatch {
    pub(super) fn new(counts: Counts) -> Self {
        Self {
            number: counts.number(),
            watches: counts.bits < 64 && !(counts.signed && counts.modulus.is_some()),
            sign: if counts.signed {
                1 << (counts.bits.clamp(1, 64) - 1)
            } else {
                0
            },
            lowest: if counts.signed { u64::MAX } else { 0 },
            highest: 0,
            pace: None,
            turned: false,
            early: 0,
            restarted_at: None,
        }
    }

    /// Whether the way between two counts leads over a wrap that is not believed any more.
    pub(super) fn doubts(&self, from: Count, to: Count) -> bool {
        self.early >= CONVINCING_WRAPS && self.wraps(from, to)
    }

    /// Whether it has seemed to restart within `reach` counts of here before.
    #[expect(clippy::cast_precision_loss, reason = "compared with a reach")]
    pub(super) fn has_jumped_from(&self, from: Count, reach: f64) -> bool {
        self.watches
            && self
                .restarted_at
                .is_some_and(|before| before.abs_diff(self.place(from)) as f64 <= 2.0 * reach)
    }

    /// The encoder seemed to restart.
    pub(super) fn restarted(&mut self, from: Count) {
        self.restarted_at = Some(self.place(from));
        self.lost();
    }

    /// Nobody saw how the count went on.
    pub(super) fn lost(&mut self) {
        (self.pace, self.turned) = (None, false);
    }

    /// The count went on by `steps`.
    pub(super) fn moved(&mut self, from: Count, to: Count, steps: f64) {
        if !self.watches {
            return;
        }
        let elapsed_ns = elapsed_ns(from, to);
        if self.wraps(from, to) {
            self.wrapped(steps, elapsed_ns);
            return;
        }
        self.saw(self.place(to));
        self.pace = (elapsed_ns > 0.0).then(|| steps.abs() / elapsed_ns);
        self.turned |= self.is_middle(self.place(to));
    }

    fn saw(&mut self, place: u64) {
        let (lowest, highest) = (self.lowest.min(place), self.highest.max(place));
        if (lowest, highest) != (self.lowest, self.highest) {
            (self.lowest, self.highest, self.early) = (lowest, highest, 0);
        }
    }

    /// Its place among the counts, from the lowest on.
    fn place(&self, count: Count) -> u64 {
        count.raw ^ self.sign
    }

    /// One wrap a turn says something; a wheel that rocks to and fro over it says nothing more.
    fn wrapped(&mut self, steps: f64, elapsed_ns: f64) {
        let Some(pace) = self.pace.filter(|_| self.turned) else {
            return;
        };
        self.turned = false;
        let (missing, surplus) = (self.missing(), steps.abs() - pace * elapsed_ns);
        let fits =
            missing >= FEWEST_MISSING_COUNTS && (surplus - missing).abs() <= missing / 4.0 + 1.0;
        self.early = if fits {
            self.early.saturating_add(1)
        } else {
            0
        };
    }

    /// Counts that were never seen.
    #[expect(clippy::cast_precision_loss, reason = "small where it matters")]
    fn missing(&self) -> f64 {
        self.number - 1.0 - self.highest.saturating_sub(self.lowest) as f64
    }

    #[expect(clippy::cast_precision_loss, reason = "small where it matters")]
    fn wraps(&self, from: Count, to: Count) -> bool {
        self.place(from).abs_diff(self.place(to)) as f64 > self.number / 2.0
    }

    #[expect(clippy::cast_precision_loss, reason = "small where it matters")]
    fn is_middle(&self, place: u64) -> bool {
        (0.25..0.75).contains(&(place as f64 / self.number))
    }
}

#[expect(
    clippy::cast_precision_loss,
    reason = "nanoseconds of days are within 2^53"
)]
fn elapsed_ns(from: Count, to: Count) -> f64 {
    to.stamp_ns.saturating_sub(from.stamp_ns).max(0) as f64
}
