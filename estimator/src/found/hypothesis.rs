//! "Where I am if this source is right and the wheels are": fed by that source alone.

use super::lifted::{Lifted, Wandering};
use super::stride::Stride;
use super::turned::{Looking, Turned};
use super::word::{Said, Test, Word};
use crate::belief::Belief;
use crate::stamp::{Span, Stamp};

/// So many refusals, net of those that were accepted, and its source does not move as the wheels do.
const CONTRADICTED: f64 = 3.0;

/// An accepted word takes this from the refusals.
const FORGIVEN: f64 = 0.34;

/// A fix after less than this says nothing of the heading \[m\].
const SOME_WAY_M: f64 = 0.01;

/// One source's hypothesis.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Hypothesis {
    pub(crate) lifted: Lifted,
    pub(crate) born: Stamp,
    /// Words that it took.
    pub(crate) taken: u32,
    /// Words that tell of the heading: poses, and fixes that came after some way. The first of them counts.
    pub(crate) tellings: u32,
    /// The way since the last word that was taken \[m\].
    way_m: f64,
    refused: f64,
    /// Since when it has had what it takes to become the belief.
    pub(crate) leads_since: Option<Stamp>,
    /// How long the belief had taken nothing when it was born.
    pub(crate) gap: Span,
    /// It goes on from a belief that the wheels stood by.
    pub(crate) confirmed: bool,
    /// Variance of its source's slow error \[m²\], and how long that lasts \[s\].
    slow: f64,
    memory_s: f64,
    /// How far its source's antenna swings when the robot turns by a radian \[m\].
    lever_m: f64,
    /// The headings that it heard.
    pub(crate) turned: Turned,
}

/// What became of a word.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Fed {
    /// It was taken, or refused.
    Judged,
    /// It contradicts the wheels for good, and begins again with this word.
    Anew,
}

impl Hypothesis {
    /// Begins with what `word` says, from nothing.
    pub(crate) fn beginning(word: &Word, gap: Span) -> Self {
        let lifted = match &word.said {
            Said::Fix {
                position,
                lever,
                white,
                slow,
                ..
            } => Lifted::at_fix(*position, *lever, white, *slow),
            Said::Pose { pose, parts } => Lifted::of(&Belief::gaussian(*pose, *parts)),
        };
        Self {
            taken: 1,
            ..Self::continuing(&lifted, word, gap)
        }
    }

    /// Goes on from `lifted`, of a position and a heading that somebody else knew, and then hears `word`.
    pub(crate) fn from(lifted: &Lifted, turned: Turned, word: &Word, gap: Span) -> Self {
        Self {
            turned,
            ..Self::continuing(&lifted.for_source(word.slow()), word, gap)
        }
    }

    /// What was believed, and whether the wheels stood by it, before `word` is heard.
    pub(crate) fn going_on(belief: &Belief, word: &Word, gap: Span, confirmed: bool) -> Self {
        let turned = Turned::by_belief(word.stamp);
        Self {
            confirmed,
            ..Self::from(&Lifted::of(belief), turned, word, gap)
        }
    }

    fn continuing(lifted: &Lifted, word: &Word, gap: Span) -> Self {
        let [forward, left] = word.lever();
        Self {
            lifted: *lifted,
            born: word.stamp,
            taken: 0,
            tellings: 1,
            way_m: 0.0,
            refused: 0.0,
            leads_since: None,
            gap,
            confirmed: false,
            slow: word.slow(),
            memory_s: word.memory_s(),
            lever_m: libm::hypot(forward, left),
            turned: Turned::default(),
        }
    }

    /// A motion of `dt_s` passes.
    pub(crate) fn step(&mut self, stride: &Stride, dt_s: f64) {
        let wandering = Wandering::over(dt_s, self.slow, self.memory_s);
        self.lifted.step(stride, wandering);
        self.turned.step(stride);
        self.way_m += libm::sqrt(stride.way.norm_sqr());
        if self.lever_m > 0.0 {
            self.way_m += self.lever_m * libm::atan2(stride.turn.im, stride.turn.re).abs();
        }
    }

    /// A heading, which every hypothesis hears.
    pub(crate) fn turn(&mut self, said: &Looking) {
        if self.turned.take(said, &mut self.lifted) {
            self.tellings = self.tellings.saturating_add(1);
        }
    }

    /// The source's next word, and how the hypothesis took it.
    pub(crate) fn feed(&mut self, word: &Word, lever: f64) -> (Test, Fed) {
        let test = word.test_own(&self.lifted);
        if test.passes() {
            self.take(word, lever);
        } else {
            self.refused += 1.0;
        }
        let contradicted =
            self.refused >= CONTRADICTED || self.lifted.direction().contradicts_wheels();
        if contradicted || !self.lifted.is_finite() {
            let turned = self.turned.contradicted();
            *self = Self {
                turned,
                ..Self::beginning(word, self.gap)
            };
            return (test, Fed::Anew);
        }
        (test, Fed::Judged)
    }

    /// It takes the word, whatever the distance.
    pub(crate) fn take(&mut self, word: &Word, lever: f64) {
        self.taken = self.taken.saturating_add(1);
        let tells = self.way_m > SOME_WAY_M || word.tells_heading();
        self.tellings = self.tellings.saturating_add(u32::from(tells));
        self.way_m = 0.0;
        self.refused = (self.refused - FORGIVEN).max(0.0);
        match &word.said {
            Said::Fix {
                position,
                lever,
                white,
                ..
            } => self.lifted.correct(*position, *lever, white),
            Said::Pose { pose, parts } => {
                // How it is correlated with what was said before is not known: the better one stays.
                let said = Lifted::of(&Belief::gaussian(*pose, *parts));
                if said.size(lever) < self.lifted.size(lever) {
                    self.lifted = said;
                }
            }
        }
    }

    /// Nothing has told of its heading since it was born.
    pub(crate) fn has_stood(&self) -> bool {
        self.tellings <= 1
    }

    pub(crate) fn age(&self, now: Stamp) -> Span {
        now - self.born
    }
}
