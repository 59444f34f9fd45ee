//! When a hypothesis becomes the belief.
//!
//! With S the sources that agree with the hypothesis and disagree with the belief, A those that stand by the belief, and O those
//! that disagree with the hypothesis, `S_p` is the number of those in A and O, and one for the wheels of a belief that was confirmed.
//! A majority, `S > S_p`, waits 3 s, or 12 s where S is no more than O; one source alone against the wheels alone waits 12 s
//! and needs [`TrustJump::Robot`]. Lies of less than that never win.

use super::hypothesis::Hypothesis;
use super::lifted::Lifted;
use super::seat::Seat;
use super::{Decision, Found, Ruling, SEATS, TRIAL, TrustJump, Word};
use crate::belief::Belief;
use crate::output::Source;
use crate::settings::Settings;
use crate::stamp::{Span, Stamp};

const MAJORITY_WAITS: Span = Span::from_millis(3_000);
const LONE_WAITS: Span = Span::from_millis(12_000);

/// Without a belief: a hypothesis younger than this, or of fewer words that tell of the heading, is none yet. Who has stood for long has
/// told all but that.
const GROWN: Span = Span::from_millis(1_000);
const GROWN_WORDS: u32 = 5;

/// With [`TrustJump::Receiver`] a jump of a slow receiver is over after so many of its memories.
const JUMP_MEMORIES: i64 = 3;

/// How the sources stand to a hypothesis and to the belief.
#[derive(Copy, Clone, Debug, Default)]
struct Count {
    /// S
    for_it: u8,
    /// `S_p`
    for_belief: u8,
    /// O
    against_it: u8,
    /// A
    by_belief: u8,
    /// All that agree with it.
    agree: u8,
}

impl Found {
    /// The belief that takes the place of this one, or that there is none now.
    pub(super) fn take_over(
        &mut self,
        word: &Word,
        prior: &Belief,
        settings: &Settings,
    ) -> Option<Ruling> {
        let now = word.stamp;
        self.hypotheses().next()?;
        self.end_jumps(word, settings);
        let lever = settings.fusion.heading_lever_m;
        let mut best: Option<(f64, usize, Belief)> = None;
        let mut open: Option<usize> = None;
        for at in 0..self.seated {
            if !self.has_hypothesis(at) || !self.is_ripe(at, now, settings.found.trust_jump) {
                continue;
            }
            let Some((_, lifted)) = self.hypothesis_of(at) else {
                continue;
            };
            if !lifted.direction().is_resolved() {
                open = open.or(Some(at));
                continue;
            }
            // One whose heading is nearly known is waited for.
            let size = lifted.size(lever);
            if let Some(belief) = lifted.as_found()
                && best.is_none_or(|(least, ..)| size < least)
            {
                best = Some((size, at, belief));
            }
        }
        match (best, open) {
            (Some((_, at, belief)), _) => self.follow(at, &belief, now, prior),
            (None, Some(at)) if self.knows => self.give_up(at, now, prior),
            _ => None,
        }
    }

    /// Where the robot starts is given, no source has said anything else, and headings tell which way it looks: nothing is missing.
    pub(super) fn follow_seed(
        &mut self,
        now: Stamp,
        source: Source,
        prior: &Belief,
    ) -> Option<Ruling> {
        let lifted = self.seed.filter(|_| !self.knows)?;
        let turned = self.seed_turned;
        let grown =
            turned.first.is_some_and(|first| now - first >= GROWN) && turned.taken >= GROWN_WORDS;
        if !grown || self.hypotheses().next().is_some() {
            return None;
        }
        let belief = lifted.as_found()?;
        let distance_m = self.distance(&lifted, prior);
        (self.knows, self.seed, self.last_taken) = (true, None, now);
        let decision = Decision::Followed {
            source,
            distance_m,
            votes: [1, 0],
        };
        self.finding.decide(now, decision);
        Some(Ruling::Replaced(belief))
    }

    /// With trust in the receiver a jump is its own, and passes.
    fn end_jumps(&mut self, word: &Word, settings: &Settings) {
        if settings.found.trust_jump == TrustJump::Robot {
            return;
        }
        let memory_ns = Span::from_seconds(word.memory_s()).as_nanos();
        let seats = self.seats[..self.seated].iter_mut().flatten();
        for seat in seats.filter(|seat| seat.source == word.source) {
            if let Some((_, lasts)) = &mut seat.jumped {
                *lasts = Span::from_nanos(memory_ns.saturating_mul(JUMP_MEMORIES));
            }
        }
    }

    fn has_hypothesis(&self, at: usize) -> bool {
        self.hypothesis_at(at).is_some()
    }

    /// Whether it has had what it takes for long enough.
    fn is_ripe(&mut self, at: usize, now: Stamp, trust: TrustJump) -> bool {
        let count = self.count(at, now);
        let (knows, Some(seat)) = (self.knows, &mut self.seats[at]) else {
            return false;
        };
        let (own, against) = (seat.agrees_with(at, now), seat.disagrees(now));
        let Some(hypothesis) = &mut seat.hypothesis else {
            return false;
        };
        if !knows {
            let grown = hypothesis.age(now) >= GROWN && hypothesis.tellings >= GROWN_WORDS;
            return own && grown && count.agree > count.against_it;
        }
        let waits = count.waits(trust).filter(|_| own && against);
        let Some(waits) = waits else {
            hypothesis.leads_since = None;
            return false;
        };
        now - *hypothesis.leads_since.get_or_insert(now) >= waits
    }

    fn count(&self, at: usize, now: Stamp) -> Count {
        let wheels = u8::from(self.knows && self.is_confirmed());
        let mut count = Count {
            for_belief: wheels,
            ..Count::default()
        };
        for seat in self.taken() {
            count.add(seat, at, now);
        }
        count
    }

    /// The hypothesis becomes the belief.
    fn follow(&mut self, at: usize, belief: &Belief, now: Stamp, prior: &Belief) -> Option<Ruling> {
        let (source, lifted) = self.hypothesis_of(at)?;
        let count = self.count(at, now);
        let distance_m = self.distance(&lifted, prior);
        self.words = self.taken_by(at);
        if self.knows || self.goes_on(at) || count.agree > 1 {
            self.confirmed = self.words;
        } else {
            (self.confirmed, self.tried_until) = (0, now + TRIAL);
        }
        (self.knows, self.seed, self.last_taken) = (true, None, now);
        self.hand_votes_over(at, now);
        self.finding.decide(
            now,
            Decision::Followed {
                source,
                distance_m,
                votes: [count.agree, count.for_belief],
            },
        );
        Some(Ruling::Replaced(*belief))
    }

    /// What was held of the hypothesis is held of the belief; who agrees needs none of its own.
    fn hand_votes_over(&mut self, at: usize, now: Stamp) {
        let mut gone = [false; SEATS];
        for (seat, gone) in self.seats.iter_mut().zip(&mut gone) {
            let Some(seat) = seat else {
                continue;
            };
            seat.judge_anew(seat.on[at]);
            *gone = seat.agrees_with(at, now) && !seat.watched;
        }
        for (other, _) in gone.iter().enumerate().filter(|(_, gone)| **gone) {
            if let Some(seat) = &mut self.seats[other] {
                seat.hypothesis = None;
            }
            self.forget_votes_on(other);
        }
    }

    /// It stands, and its heading is open: who was carried may have been turned.
    fn give_up(&mut self, at: usize, now: Stamp, prior: &Belief) -> Option<Ruling> {
        let (source, lifted) = self.hypothesis_of(at)?;
        let distance_m = self.distance(&lifted, prior);
        self.drop_belief();
        let dropped = Decision::Dropped { source, distance_m };
        self.finding.decide(now, dropped);
        Some(Ruling::Dropped)
    }

    fn distance(&self, lifted: &Lifted, prior: &Belief) -> f64 {
        if !self.knows {
            return f64::NAN;
        }
        lifted.distance_from(&prior.pose)
    }

    fn taken_by(&self, at: usize) -> u32 {
        self.hypothesis_at(at).map_or(0, |it| it.taken)
    }

    /// From a belief that was confirmed.
    fn goes_on(&self, at: usize) -> bool {
        self.hypothesis_at(at).is_some_and(|it| it.confirmed)
    }

    fn hypothesis_at(&self, at: usize) -> Option<&Hypothesis> {
        self.seats[at].as_ref()?.hypothesis.as_ref()
    }

    /// So many stand by the belief, the wheels among them, and so many against it.
    pub(super) fn balance(&self, now: Stamp) -> (usize, usize) {
        let seats = || self.taken();
        let by = seats().filter(|seat| seat.stands_by(now)).count();
        let against = seats().filter(|seat| seat.disagrees(now)).count();
        (by + usize::from(self.is_confirmed()), against)
    }
}

impl Count {
    fn add(&mut self, seat: &Seat, at: usize, now: Stamp) {
        let (with, not_with) = (seat.agrees_with(at, now), seat.disagrees_with(at, now));
        let (by, not_by) = (seat.stands_by(now), seat.disagrees(now));
        self.agree += u8::from(with);
        self.for_it += u8::from(with && not_by);
        self.against_it += u8::from(not_with);
        self.by_belief += u8::from(by);
        self.for_belief += u8::from(by && not_with);
    }

    /// How long it has to last; `None` if it is not enough.
    fn waits(self, trust: TrustJump) -> Option<Span> {
        if self.for_it > self.for_belief {
            let outvoted = self.for_it <= self.against_it;
            return Some(if outvoted { LONE_WAITS } else { MAJORITY_WAITS });
        }
        let alone = self.for_it == 1 && self.for_belief == 1;
        let undisputed = self.against_it == 0 && self.by_belief == 0;
        (alone && undisputed && trust == TrustJump::Robot).then_some(LONE_WAITS)
    }
}
