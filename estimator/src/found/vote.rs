//! What one source holds of one possibility: of the belief, or of a hypothesis.

use super::word::Test;
use crate::stamp::{Span, Stamp};

/// Refusals that stand against it, net of what was accepted since, at which a source disagrees; where it ends; and what of
/// accepted words it takes to agree. Four independent refusals come by chance once in 10⁸.
const DISAGREES: f64 = 4.0;
const ENDS: f64 = 1.0;
const AGREES: f64 = 4.0;

/// Below this score a source that is with many still counts as agreeing, and below that one that is with the belief does.
const DOUBTS: f64 = 2.0;
const TOLERATES: f64 = 3.0;
const STANDS_BY: f64 = 2.0;

/// No count goes above this.
const MOST: f64 = 8.0;

/// A vote older than this does not count.
const LASTS: Span = Span::from_millis(10_000);

/// Counts of a source's words, each weighed by what is new in it.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Vote {
    refused: f64,
    accepted: f64,
    disagrees: bool,
    agrees: bool,
    /// Of the last word.
    stamp: Stamp,
}

/// How much a word counts: refused, and accepted.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Weight {
    pub(crate) refused: f64,
    pub(crate) eased: f64,
    pub(crate) accepted: f64,
}

impl Vote {
    /// After a word. `may_end`: what else has to hold before a disagreement ends, does.
    pub(crate) fn cast(&mut self, stamp: Stamp, test: &Test, weight: &Weight, may_end: bool) {
        if test.passes() {
            self.accept(stamp, weight.eased, weight.accepted, may_end);
            return;
        }
        self.stamp = stamp;
        self.refused = (self.refused + weight.refused).min(MOST);
        self.accepted = (self.accepted - 2.0 * weight.refused).max(0.0);
        self.conclude(may_end);
    }

    /// After a word that is as it should be.
    #[inline]
    pub(crate) fn accept(&mut self, stamp: Stamp, eased: f64, accepted: f64, may_end: bool) {
        self.stamp = stamp;
        self.refused = (self.refused - 0.5 * eased).max(0.0);
        self.accepted = (self.accepted + accepted).min(MOST);
        self.conclude(may_end);
    }

    #[inline]
    fn conclude(&mut self, may_end: bool) {
        if self.refused >= DISAGREES {
            self.disagrees = true;
        } else if self.refused < ENDS && may_end {
            self.disagrees = false;
        }
        self.latch();
    }

    /// One that agrees does so until it doubts: two wrong words of a receiver with long tails end nothing.
    #[inline]
    fn latch(&mut self) {
        let clear = self.accepted >= AGREES && self.refused < DOUBTS;
        let keeps = self.agrees && self.accepted >= STANDS_BY && self.refused < TOLERATES;
        self.agrees = !self.disagrees && (clear || keeps);
    }

    pub(crate) fn disagrees(&self, now: Stamp) -> bool {
        self.disagrees && self.counts(now)
    }

    pub(crate) fn agrees(&self, now: Stamp) -> bool {
        self.agrees && self.counts(now)
    }

    /// As [`Self::agrees`], of a source that has fewer reasons to leave the belief.
    pub(crate) fn stands_by(&self, now: Stamp) -> bool {
        let clear = !self.disagrees && self.accepted >= STANDS_BY && self.refused < TOLERATES;
        clear && self.counts(now)
    }

    /// The belief takes what the source says again.
    pub(crate) fn is_reconciled(&self) -> bool {
        !self.disagrees && self.refused < ENDS && self.accepted >= STANDS_BY
    }

    fn counts(&self, now: Stamp) -> bool {
        now - self.stamp <= LASTS
    }
}

impl Weight {
    /// All of it is new.
    pub(crate) const WHOLE: Self = Self {
        refused: 1.0,
        eased: 1.0,
        accepted: 1.0,
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::found::word::Test;

    fn cast(vote: &mut Vote, at_s: i64, d2: f64) {
        let stamp = Stamp::default() + Span::from_millis(1000 * at_s);
        vote.cast(stamp, &Test::of_fix(d2), &Weight::WHOLE, true);
    }

    fn at(second: i64) -> Stamp {
        Stamp::default() + Span::from_millis(1000 * second)
    }

    #[test]
    fn four_refusals_are_a_no_that_lasts_until_it_is_taken_back() {
        let mut vote = Vote::default();
        for second in 0..4 {
            assert!(!vote.disagrees(at(second)));
            cast(&mut vote, second, 20.0);
        }
        assert!(vote.disagrees(at(4)) && !vote.agrees(at(4)) && !vote.stands_by(at(4)));
        for second in 4..10 {
            cast(&mut vote, second, 1.0);
            assert!(vote.disagrees(at(second)), "it is latched");
        }
        cast(&mut vote, 10, 1.0);
        assert!(!vote.disagrees(at(10)) && vote.agrees(at(10)) && vote.is_reconciled());
    }

    #[test]
    fn a_silent_one_has_no_vote() {
        let (mut against, mut with) = (Vote::default(), Vote::default());
        for second in 0..6 {
            cast(&mut against, second, 20.0);
            cast(&mut with, second, 1.0);
        }
        assert!(against.disagrees(at(15)) && with.agrees(at(15)));
        assert!(!against.disagrees(at(16)) && !with.agrees(at(16)) && !with.stands_by(at(16)));
    }

    #[test]
    fn what_may_not_end_does_not() {
        let mut vote = Vote::default();
        (0..4).for_each(|second| cast(&mut vote, second, 20.0));
        for second in 4..30 {
            vote.cast(at(second), &Test::of_fix(1.0), &Weight::WHOLE, false);
        }
        assert!(vote.disagrees(at(30)));
    }

    #[test]
    fn one_tail_flips_nothing() {
        let mut vote = Vote::default();
        (0..8).for_each(|second| cast(&mut vote, second, 1.0));
        cast(&mut vote, 8, 20.0);
        assert!(vote.agrees(at(8)) && vote.stands_by(at(8)) && !vote.disagrees(at(8)));
    }
}
