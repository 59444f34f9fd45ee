//! All that is kept of one source.

use super::SEATS;
use super::hypothesis::Hypothesis;
use super::mean::Mean;
use super::vote::Vote;
use super::word::Word;
use crate::output::Source;
use crate::stamp::{Span, Stamp};

/// A source, what it holds of the belief and of every hypothesis, and the hypothesis that it feeds.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Seat {
    pub(crate) source: Source,
    /// Of its last word.
    pub(crate) last: Stamp,
    pub(crate) on_belief: Vote,
    /// On the hypothesis of each seat.
    pub(crate) on: [Vote; SEATS],
    pub(crate) mean: Mean,
    pub(crate) hypothesis: Option<Hypothesis>,
    /// It has a slow error: its hypothesis lives as long as the seat.
    pub(crate) watched: bool,
    /// A watched source's hypothesis began again: it has jumped, or the robot has. Since when, and for how long that stands.
    pub(crate) jumped: Option<(Stamp, Span)>,
    /// Since when it disagrees with the belief.
    pub(crate) against_since: Option<Stamp>,
    /// d² of its last word on the belief.
    pub(crate) d2: f64,
}

impl Seat {
    pub(crate) fn new(source: Source, now: Stamp) -> Self {
        Self {
            source,
            last: now,
            on_belief: Vote::default(),
            on: [Vote::default(); SEATS],
            mean: Mean::default(),
            hypothesis: None,
            watched: false,
            jumped: None,
            against_since: None,
            d2: 0.0,
        }
    }

    /// Another word of it: how much of that is new, as a part of one.
    #[inline]
    pub(crate) fn news(&mut self, word: &Word) -> f64 {
        let since_s = (word.stamp - self.last).as_seconds();
        let is_first = self.last == word.stamp && self.hypothesis.is_none();
        self.last = word.stamp;
        self.watched = word.is_watched();
        let memory_s = word.memory_s();
        if is_first || since_s >= memory_s {
            1.0
        } else {
            since_s / memory_s
        }
    }

    /// With the belief, for whatever reason.
    pub(crate) fn disagrees(&self, now: Stamp) -> bool {
        self.on_belief.disagrees(now) || self.mean.disagrees() || self.has_jumped(now)
    }

    /// Whether its words go to a hypothesis, even if the belief takes them.
    #[inline]
    pub(crate) fn needs_hypothesis(&self, now: Stamp) -> bool {
        self.hypothesis.is_some() || self.watched || self.disagrees(now)
    }

    /// With the belief.
    pub(crate) fn stands_by(&self, now: Stamp) -> bool {
        self.on_belief.stands_by(now) && !self.disagrees(now)
    }

    /// With the hypothesis of seat number `index`.
    pub(crate) fn agrees_with(&self, index: usize, now: Stamp) -> bool {
        self.on.get(index).is_some_and(|vote| vote.agrees(now))
    }

    /// With the hypothesis of seat number `index`.
    pub(crate) fn disagrees_with(&self, index: usize, now: Stamp) -> bool {
        self.on.get(index).is_some_and(|vote| vote.disagrees(now))
    }

    /// There is a new belief, of which it holds what it held of the hypothesis that it was.
    pub(crate) fn judge_anew(&mut self, on_belief: Vote) {
        self.on_belief = on_belief;
        self.mean.clear();
        self.jumped = None;
    }

    /// Whose place may be given away: it was silent for long and stands for nothing.
    pub(crate) fn is_idle(&self, now: Stamp, silent: Span) -> bool {
        now - self.last > silent && !self.disagrees(now)
    }

    fn has_jumped(&self, now: Stamp) -> bool {
        self.jumped
            .is_some_and(|(since, lasts)| now - since <= lasts)
    }
}
