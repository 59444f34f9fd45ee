//! Lost and found: a start from nowhere, robots that were carried, outages, and sources that lie, in fixed memory.
//!
//! # The idea
//!
//! * A hypothesis is linear in position, direction and its source's slow error, and so exact at any heading.
//! * It belongs to one source: "where I am if this source is right and the wheels are". That source alone feeds it; the others
//!   vote on it, and on the belief, by tests that an honest source passes 99 times of 100.
//! * Who stands against whom is counted in sources. The wheels count as one for a belief that was once confirmed: that a robot was
//!   carried means that its wheels lied. A lone source against the wheels is decided by a setting ([`TrustJump`]), because the data
//!   are the same whether the robot was carried or the source lies.
//! * A source that disagrees with the belief is not fused, and judged on. The gate never widens.
//! * Only what leaves the history is judged. So the belief, the states and what is told of them are a function of the set of
//!   inputs, a history's length late, and its entries stay small.
//!
//! # What happens to a word that leaves the history
//!
//! Its source votes on the belief, then on the hypotheses of the others; then it feeds its own, which is born where there is none
//! and the belief refuses the word. Where the heading is too uncertain for a fix to be fused (its update is linear) the belief
//! becomes a hypothesis. A source with which the belief is reconciled loses its hypothesis. Last it is asked whether a
//! hypothesis becomes the belief.
//!
//! A pose that a person sets is followed at once. Nobody has confirmed it, the wheels neither: sources that disagree win by a
//! majority, as against any other belief.

mod circle;
mod columns;
mod cover;
mod drag;
mod finding;
mod hypothesis;
mod lifted;
mod mean;
mod moments;
mod seat;
mod settings;
mod start;
mod stride;
mod takeover;
mod turned;
mod vote;
mod word;

pub use finding::{Decided, Decision, Dissent, Finding, FindingState};
pub use settings::{FoundSettings, TrustJump};
pub use start::Start;

use hypothesis::{Fed, Hypothesis};
use lifted::Lifted;
use nalgebra::{Matrix2, Vector2};
use seat::Seat;
pub(crate) use stride::Stride;
pub(crate) use turned::Looking;
use turned::Turned;
use vote::{Vote, Weight};
use word::Test;
pub(crate) use word::{Gauge, Word};

use crate::belief::Belief;
use crate::kind::{Kind, PoseSaid};
use crate::lever;
use crate::list::FixedList;
use crate::motion::Motion;
use crate::output::Source;
use crate::settings::Settings;
use crate::stamp::{Span, Stamp};

/// Sources that are judged at a time.
pub(crate) const SEATS: usize = 16;

/// A heading less certain than this is not updated by a fix, which says nothing of it by itself (σ² \[rad²\]).
const WIDE: f64 = 0.3 * 0.3;

/// The same of a robot that sees others: a sighting teaches its heading where it stands, while a fix waits for it to drive.
const WIDE_AMONG_OTHERS: f64 = 1.0;

/// As one Gaussian no sighting teaches a heading that is less certain than this (σ² \[rad²\]): it may as well be any.
pub(crate) const OPEN: f64 = 2.0 * 2.0;

/// Words that the belief has to take before the wheels stand by it.
const CONFIRMED: u32 = 5;

/// Words that a belief takes so soon after it was followed from nowhere do not count: they are from the way that it was found by. Who
/// goes on from a belief that was confirmed, after an outage, is not from nowhere; where two sources agree on the way, not one alone
/// says that the wheels are right.
const TRIAL: Span = Span::from_millis(5_000);

/// Nothing was heard for so long: lost, if it is not known where.
const SILENT: Span = Span::from_millis(10_000);

/// After an outage: so many fixes that agree with each other, so soon after the belief took nothing for so long.
const CHANCE_WORDS: u32 = 3;
const CHANCE_GAP: Span = Span::from_millis(5_000);
const CHANCE_AGE: Span = Span::from_millis(5_000);

/// Or whenever it has refused everything for so long, and nobody stands against it.
const STARVED: Span = Span::from_millis(10_000);

/// A heading that has come as near to that of a hypothesis, in σ, may be the same.
const SAME_HEADING: f64 = 4.0;

/// A hypothesis whose heading is known better than this has one to compare \[rad\].
const COMPARABLE: f64 = 0.5;

/// And better than this before it may end a disagreement: what is known to half a radian agrees with any heading \[rad\].
const TELLS_APART: f64 = 0.25;

/// Words after which a hypothesis tells where a shift is.
const TOLD: u32 = 20;

/// Three of them are as good as four refusals: a robot that was carried is noticed that much sooner.
const FLAGRANT: f64 = 4.0 / 3.0 + 1e-9;

/// What the judge makes of a word.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) enum Ruling {
    /// The belief after it stands.
    Stands,
    /// There is no belief any more.
    Dropped,
    /// This is the belief.
    Replaced(Belief),
}

/// The sources, their hypotheses and their votes.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    seats: [Option<Seat>; SEATS],
    /// So many of them were ever taken, the first ones.
    seated: usize,
    /// A position that is known from the start, for every source.
    seed: Option<Lifted>,
    /// The headings that it heard.
    seed_turned: Turned,
    /// Whether there is a belief.
    knows: bool,
    /// Words that the belief took.
    words: u32,
    /// Those of them that count for the wheels.
    confirmed: u32,
    /// When the belief took its last word; at first, the start.
    last_taken: Stamp,
    last_word: Stamp,
    /// Until then the words that the belief takes do not count for the wheels.
    tried_until: Stamp,
    /// Who is not fused.
    suspended: FixedList<Source, SEATS>,
    /// Whether there is a seed or a hypothesis, which the wheels drive.
    driven: bool,
    finding: Finding,
}

impl Found {
    #[allow(clippy::large_stack_arrays)] // 17 kB, once.
    pub(crate) fn new(stamp: Stamp, start: &Start) -> Self {
        let seed = match start {
            Start::Position(position, covariance) => {
                Some(Lifted::placed(*position, &covariance.matrix()))
            }
            Start::Known(_) | Start::Unknown => None,
        };
        let filler = Source::new(Kind::Fix, 0);
        Self {
            seats: [None; SEATS],
            seated: 0,
            seed,
            seed_turned: Turned::default(),
            knows: start.is_known(),
            words: 0,
            confirmed: 0,
            last_taken: stamp,
            last_word: stamp,
            tried_until: stamp,
            suspended: FixedList::new(filler),
            driven: seed.is_some(),
            finding: Finding::beginning(stamp, start.is_known()),
        }
    }

    pub(crate) fn finding(&self) -> &Finding {
        &self.finding
    }

    /// Whether others may be told where they are.
    #[inline]
    pub(crate) fn is_ok(&self) -> bool {
        self.finding.state == FindingState::Ok
    }

    /// Who is not fused.
    #[inline]
    pub(crate) fn suspended(&self) -> &[Source] {
        self.suspended.as_slice()
    }

    /// Whether a motion has to be passed on.
    #[inline]
    pub(crate) fn is_driven(&self) -> bool {
        self.driven
    }

    /// `dt_s` of `motion` pass.
    pub(crate) fn drive(&mut self, motion: &Motion, dt_s: f64) {
        let stride = Stride::of(motion, dt_s);
        if let Some(seed) = &mut self.seed {
            seed.step(&stride, lifted::Wandering::NONE);
            self.seed_turned.step(&stride);
        }
        for seat in self.seats[..self.seated].iter_mut().flatten() {
            if let Some(hypothesis) = &mut seat.hypothesis {
                hypothesis.step(&stride, dt_s);
            }
        }
    }

    /// A word has left the history with which the belief agrees, and nobody is in doubt of anything, nor is now. `None` where it
    /// takes more ([`Self::hear`]).
    #[inline]
    pub(crate) fn hear_plain(&mut self, word: &Word) -> Option<()> {
        let all_agree = self.knows && !self.driven && self.suspended.as_slice().is_empty();
        let test = word.test_belief();
        if !all_agree || word.gauge.wide || word.is_watched() || !test.passes() {
            return None;
        }
        let mut seats = self.seats[..self.seated].iter_mut().flatten();
        let seat = seats.find(|seat| seat.source == word.source)?;
        let is_fix = word.is_fix();
        if is_fix {
            let mean = seat.mean.after(word.gauge.normalised);
            if mean.disagrees() || mean.is_doubtful() {
                return None;
            }
            seat.mean = mean;
        }
        let news = seat.news(word);
        let accepted = if is_fix { 1.0 } else { news };
        seat.on_belief.accept(word.stamp, news, accepted, true);
        seat.d2 = test.d2;
        self.last_word = word.stamp;
        self.took(word.stamp);
        Some(())
    }

    /// A word has left the history; `prior` is the belief before it.
    pub(crate) fn hear(
        &mut self,
        word: &Word,
        prior: &Belief,
        settings: &Settings,
    ) -> (Ruling, bool) {
        let ruling = self.judge(word, prior, settings);
        self.driven = self.seed.is_some() || self.hypotheses().next().is_some();
        (ruling, self.list_suspended(word.stamp))
    }

    fn judge(&mut self, word: &Word, prior: &Belief, settings: &Settings) -> Ruling {
        self.last_word = word.stamp;
        let Some(at) = self.seat_for(word) else {
            self.finding.unseated = self.finding.unseated.saturating_add(1);
            return Ruling::Stands;
        };
        let news = self.seats[at].as_mut().map_or(0.0, |seat| seat.news(word));
        let seat = self.seats[at].as_ref();
        let was_against = seat.is_some_and(|seat| seat.disagrees(word.stamp));
        let refused = self.knows && !self.vote_on_belief(at, word, prior, news);
        self.vote_on_others(at, word, news);
        self.feed_own(at, word, prior, refused, settings);
        let mut ruling = self.rule(at, word, prior, refused, settings);
        if ruling == Ruling::Stands && self.knows && !was_against {
            ruling = self.undo_drag(at, word, prior);
        }
        if ruling == Ruling::Stands && self.knows && !refused {
            ruling = self.doubt(at, word, prior);
        }
        if !refused {
            self.reconcile(at, prior);
        }
        self.take_over(word, prior, settings).unwrap_or(ruling)
    }

    /// A heading has left the history. It says nothing of where the robot is; `prior` is the belief before it.
    pub(crate) fn turn(&mut self, said: &Looking, source: Source, prior: &Belief) -> Ruling {
        for seat in self.seats[..self.seated].iter_mut().flatten() {
            if let Some(hypothesis) = &mut seat.hypothesis {
                hypothesis.turn(said);
            }
        }
        if let Some(seed) = &mut self.seed {
            self.seed_turned.take(said, seed);
        }
        let ruling = self.follow_seed(said.stamp, source, prior);
        self.driven = self.seed.is_some() || self.hypotheses().next().is_some();
        ruling.unwrap_or(Ruling::Stands)
    }

    /// A pose that a person set has left the history; `prior` is the belief before it.
    pub(crate) fn set(&mut self, said: &PoseSaid, prior: &Belief) -> Ruling {
        let (source, now) = (Source::new(Kind::Pose, said.origin.source), said.stamp);
        let distance_m = if self.knows {
            libm::hypot(said.pose.x - prior.pose.x, said.pose.y - prior.pose.y)
        } else {
            f64::NAN
        };
        self.seats.iter_mut().for_each(|seat| *seat = None);
        self.suspended.clear();
        (self.knows, self.seed, self.driven) = (true, None, false);
        (self.words, self.confirmed) = (0, 0);
        (self.last_taken, self.last_word) = (now, now);
        let set = Decision::Set { source, distance_m };
        self.finding.decide(now, set);
        Ruling::Replaced(said.belief())
    }

    /// The seat of a word's source, taken where it has none; `None` if all are in use.
    fn seat_for(&mut self, word: &Word) -> Option<usize> {
        let is_held = |seat: &&Seat| seat.source == word.source;
        if let Some(at) = self.taken().position(|seat| is_held(&seat)) {
            return Some(at);
        }
        let at = self.free_seat(word.stamp)?;
        self.seated = self.seated.max(at + 1);
        self.seats[at] = Some(Seat::new(word.source, word.stamp));
        self.forget_votes_on(at);
        Some(at)
    }

    fn free_seat(&self, now: Stamp) -> Option<usize> {
        let free = self.seats.iter().position(Option::is_none);
        let idle = || {
            let places = self.seats.iter().enumerate();
            let idle = places.filter_map(|(at, seat)| {
                let seat = seat.as_ref().filter(|seat| seat.is_idle(now, SILENT))?;
                Some((seat.last, at))
            });
            idle.min().map(|(_, at)| at)
        };
        free.or_else(idle)
    }

    /// Whether the belief takes it.
    fn vote_on_belief(&mut self, at: usize, word: &Word, prior: &Belief, news: f64) -> bool {
        let test = word.test_belief();
        let Some(seat) = &mut self.seats[at] else {
            return true;
        };
        let seen = &lever::moved(prior, word.lever()).belief;
        let own = shared_of_refusal(word, seen, &test);
        let weight = weigh(word, &test, news, own);
        let may_end = seat.hypothesis.as_ref().is_none_or(|it| is_back(it, prior));
        seat.on_belief.cast(word.stamp, &test, &weight, may_end);
        seat.d2 = test.d2;
        let fused = test.passes() && !seat.disagrees(word.stamp);
        if fused {
            if word.is_white() {
                seat.mean.take(word.gauge.normalised);
            }
            self.took(word.stamp);
        }
        test.passes()
    }

    fn took(&mut self, now: Stamp) {
        let counts = now >= self.tried_until;
        self.words = self.words.saturating_add(1);
        self.confirmed = self.confirmed.saturating_add(u32::from(counts));
        self.last_taken = now;
    }

    fn vote_on_others(&mut self, at: usize, word: &Word, news: f64) {
        for other in 0..self.seated {
            if other == at {
                continue;
            }
            let Some((source, lifted)) = self.hypothesis_of(other) else {
                continue;
            };
            let both_fixes = word.source.kind == Kind::Fix && source.kind == Kind::Fix;
            let doubled = !both_fixes;
            let test = word.test_hypothesis(&lifted, doubled);
            let weight = weigh(word, &test, news, 1.0);
            if let Some(seat) = &mut self.seats[at] {
                seat.on[other].cast(word.stamp, &test, &weight, true);
            }
        }
    }

    fn hypothesis_of(&self, at: usize) -> Option<(Source, Lifted)> {
        let seat = self.seats[at].as_ref()?;
        Some((seat.source, seat.hypothesis?.lifted))
    }

    /// Its own hypothesis hears the word, or begins with it.
    fn feed_own(
        &mut self,
        at: usize,
        word: &Word,
        prior: &Belief,
        refused: bool,
        settings: &Settings,
    ) {
        let lever = settings.fusion.heading_lever_m;
        let wide = self.knows && !refused && word.gauge.wide;
        let gap = word.stamp - self.last_taken;
        let (knows, confirmed) = (self.knows, self.is_confirmed());
        let Some(seat) = &mut self.seats[at] else {
            return;
        };
        if knows && !refused && !wide && !seat.needs_hypothesis(word.stamp) {
            return;
        }
        let (seed, seed_turned) = (self.seed, self.seed_turned);
        let needs_one = !knows || refused || seat.disagrees(word.stamp) || word.is_watched();
        match (&mut seat.hypothesis, seed) {
            (hypothesis, _) if wide => {
                *hypothesis = Some(Hypothesis::going_on(prior, word, gap, confirmed));
                self.forget_votes_on(at);
                self.feed(at, word, lever);
            }
            (Some(_), _) => self.feed(at, word, lever),
            (none, Some(seed)) if needs_one && !knows && word.is_fix() => {
                *none = Some(Hypothesis::from(&seed, seed_turned, word, gap));
                self.forget_votes_on(at);
                self.feed(at, word, lever);
            }
            (none, _) if needs_one => {
                *none = Some(Hypothesis::beginning(word, gap));
                self.begin_votes(at, word);
            }
            _ => {}
        }
    }

    fn feed(&mut self, at: usize, word: &Word, lever: f64) {
        let Some(seat) = &mut self.seats[at] else {
            return;
        };
        let Some(hypothesis) = &mut seat.hypothesis else {
            return;
        };
        let (test, fed) = hypothesis.feed(word, lever);
        if fed == Fed::Judged {
            let weight = weigh(word, &test, 1.0, 1.0);
            seat.on[at].cast(word.stamp, &test, &weight, true);
            return;
        }
        if word.is_watched() {
            seat.jumped = Some((word.stamp, Span::from_nanos(i64::MAX)));
        }
        self.begin_votes(at, word);
        let source = word.source;
        self.finding.decide(word.stamp, Decision::Anew { source });
    }

    /// A hypothesis begins with `word`: nobody has judged it yet but its source.
    fn begin_votes(&mut self, at: usize, word: &Word) {
        self.forget_votes_on(at);
        if let Some(seat) = &mut self.seats[at] {
            let test = Test::PASSED;
            seat.on[at].cast(word.stamp, &test, &Weight::WHOLE, true);
        }
    }

    fn forget_votes_on(&mut self, at: usize) {
        for seat in self.seats[..self.seated].iter_mut().flatten() {
            seat.on[at] = Vote::default();
        }
    }

    /// What comes of it before anybody takes over.
    fn rule(
        &mut self,
        at: usize,
        word: &Word,
        prior: &Belief,
        refused: bool,
        settings: &Settings,
    ) -> Ruling {
        let source = word.source;
        if self.knows && !refused && word.gauge.wide {
            self.drop_belief();
            self.finding
                .decide(word.stamp, Decision::Widened { source });
            return Ruling::Dropped;
        }
        if refused && self.has_second_chance(at, word, prior, settings.found.trust_jump) {
            let mut hypothesis = Hypothesis::going_on(prior, word, Span::ZERO, self.is_confirmed());
            hypothesis.take(word, settings.fusion.heading_lever_m);
            if let Some(seat) = &mut self.seats[at] {
                seat.hypothesis = Some(hypothesis);
            }
            self.begin_votes(at, word);
            self.drop_belief();
            self.finding
                .decide(word.stamp, Decision::SecondChance { source });
            return Ruling::Dropped;
        }
        Ruling::Stands
    }

    /// Of a hundred honest robots one refuses the first fix after an outage, and then all that follow. Where it is then, far out on the
    /// bend of its distribution, no linear update of the pose is right; that of the hypothesis is.
    /// So it may be soon after a start, or whenever the belief has refused everything for long and nobody stands against it yet: its
    /// doubt grows by the way, and refusals count for next to nothing. With trust in the receiver that may be a lie that fits at last.
    fn has_second_chance(&self, at: usize, word: &Word, prior: &Belief, trust: TrustJump) -> bool {
        let Some(seat) = &self.seats[at] else {
            return false;
        };
        let Some(hypothesis) = &seat.hypothesis else {
            return false;
        };
        let own = planar_trace(&prior.total().symmetric());
        let after_gap = hypothesis.gap >= CHANCE_GAP || self.words < CONFIRMED;
        let came_late = after_gap && hypothesis.age(word.stamp) <= CHANCE_AGE;
        let starves = word.stamp - self.last_taken >= STARVED && !seat.disagrees(word.stamp);
        let is_trusted = trust == TrustJump::Robot;
        word.is_fix()
            && hypothesis.taken >= CHANCE_WORDS
            && (came_late || starves && is_trusted)
            && own > planar_trace(&word.noise())
            && !word.test_belief().is_gross()
    }

    /// The wheels stand by the belief.
    fn is_confirmed(&self) -> bool {
        self.confirmed >= CONFIRMED
    }

    fn drop_belief(&mut self) {
        self.knows = false;
        (self.words, self.confirmed) = (0, 0);
        for seat in self.seats[..self.seated].iter_mut().flatten() {
            seat.judge_anew(Vote::default());
        }
    }

    /// The belief takes what the source says again: it needs no hypothesis.
    fn reconcile(&mut self, at: usize, prior: &Belief) {
        let (knows, Some(seat)) = (self.knows, &mut self.seats[at]) else {
            return;
        };
        if let Some(hypothesis) = &seat.hypothesis
            && hypothesis.taken >= TOLD
            && is_back(hypothesis, prior)
        {
            seat.mean.reconcile();
        }
        let reconciled = seat.on_belief.is_reconciled() && !seat.mean.disagrees();
        if knows && reconciled && !seat.watched && seat.hypothesis.is_some() {
            seat.hypothesis = None;
            self.forget_votes_on(at);
        }
    }

    /// Who is not fused from now on; true if these are others than before.
    fn list_suspended(&mut self, now: Stamp) -> bool {
        let before = self.suspended;
        self.suspended.clear();
        for seat in self.seats[..self.seated].iter_mut().flatten() {
            if !self.knows || !seat.disagrees(now) {
                seat.against_since = None;
                continue;
            }
            seat.against_since.get_or_insert(now);
            let _ = self.suspended.push(seat.source); // There are as many places as seats.
        }
        before.as_slice() != self.suspended.as_slice()
    }

    /// The seats that are taken, the first ones.
    pub(super) fn taken(&self) -> impl Iterator<Item = &Seat> {
        self.seats[..self.seated].iter().flatten()
    }

    fn hypotheses(&self) -> impl Iterator<Item = (&Seat, &Hypothesis)> {
        let seats = self.taken();
        seats.filter_map(|seat| Some((seat, seat.hypothesis.as_ref()?)))
    }
}

/// The belief's own error, that of the place that the word is of, is common to refusals that follow each other: of each of them so much is the word's own.
fn shared_of_refusal(word: &Word, prior: &Belief, test: &Test) -> f64 {
    if !word.is_fix() || test.is_gross() {
        return 1.0;
    }
    let own = planar_trace(&word.noise());
    own / (own + planar_trace(&prior.total().symmetric()))
}

fn weigh(word: &Word, test: &Test, news: f64, own: f64) -> Weight {
    let weight = match (test.is_flagrant(), test.is_gross()) {
        (true, _) => FLAGRANT,
        (false, true) => 1.0,
        (false, false) => news,
    };
    Weight {
        refused: weight * own,
        eased: weight,
        accepted: if word.is_fix() { 1.0 } else { weight },
    }
}

/// Whether a hypothesis is where the belief is, and looks where it looks. A robot that was turned and crosses its old path is not found
/// by that; nor who drives off after it was carried, as long as its heading is open.
fn is_back(hypothesis: &Hypothesis, belief: &Belief) -> bool {
    is_near(&hypothesis.lifted, belief) && is_same_heading(hypothesis, belief)
}

fn is_same_heading(hypothesis: &Hypothesis, belief: &Belief) -> bool {
    let direction = hypothesis.lifted.direction();
    let sigma = direction.sigma();
    if sigma >= TELLS_APART {
        return hypothesis.has_stood();
    }
    let apart = crate::angle::wrap(direction.heading() - belief.pose.phi);
    let variance = sigma * sigma + belief.heading_variance();
    apart * apart <= SAME_HEADING * SAME_HEADING * variance
}

fn is_near(lifted: &Lifted, belief: &Belief) -> bool {
    let p = belief.total().symmetric();
    let sum = lifted.position_covariance() + Matrix2::new(p.xx, p.xy, p.xy, p.yy);
    let apart = Vector2::from(lifted.position()) - Vector2::new(belief.pose.x, belief.pose.y);
    lifted::quadratic(&sum, apart) <= crate::gate::CHI2_2_99
}

fn planar_trace(a: &crate::symmetric::Symmetric3) -> f64 {
    a.xx + a.yy
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance3;
    use crate::kind::{Measurement, NeighbourPose, Origin, PositionFix, SlowError};
    use crate::parts::Parts;
    use crate::pose::Pose;

    const NEAR: Gauge = Gauge {
        d2: 1.0,
        normalised: [0.0; 2],
        wide: false,
    };
    const FAR: Gauge = Gauge { d2: 1e4, ..NEAR };
    const WIDE_AND_NEAR: Gauge = Gauge { wide: true, ..NEAR };

    fn fix(receiver: u16, tick: i64, x: f64, gauge: Gauge) -> Word {
        let stamp = Stamp::from_nanos(200_000_000 * tick);
        let fix = PositionFix {
            stamp,
            origin: Origin {
                source: receiver,
                ..Origin::default()
            },
            position: [x, 0.0],
            covariance: crate::covariance::Covariance2::diagonal([0.01; 2]).unwrap(),
            lever: [0.0; 2],
            slow: SlowError::default(),
        };
        Word::of(stamp, &Measurement::Fix(fix), gauge).unwrap()
    }

    /// A neighbour has the robot where it is believed to be.
    fn neighbour(number: u16, tick: i64) -> Word {
        let stamp = Stamp::from_nanos(200_000_000 * tick);
        let said = NeighbourPose {
            stamp,
            origin: Origin {
                source: number,
                ..Origin::default()
            },
            pose: Pose::default(),
            parts: Parts::dependent(Covariance3::diagonal([0.01; 3]).unwrap()),
        };
        Word::of(stamp, &Measurement::Neighbour(said), NEAR).unwrap()
    }

    /// The belief takes the place of a hypothesis that somebody stood against: of the new one nobody has said anything.
    #[test]
    fn votes_on_a_hypothesis_end_when_a_wide_belief_takes_its_place() {
        let covariance = Covariance3::diagonal([0.01, 0.01, 1.0]).unwrap();
        let belief = Belief::independent(Pose::default(), covariance);
        let mut found = Found::new(Stamp::default(), &Start::Known(belief));
        let settings = Settings::default();
        let mut hear = |word: &Word| {
            let _ = found.hear(word, &belief, &settings);
            found.seats[1]
                .as_ref()
                .map_or(Vote::default(), |seat| seat.on[0])
        };
        hear(&fix(0, 1, 50.0, FAR));
        let stood_against = (2..8).map(|tick| hear(&fix(1, tick, 0.0, NEAR))).last();
        assert!(stood_against.is_some_and(|vote| vote != Vote::default()));
        assert_eq!(hear(&fix(0, 8, 0.0, WIDE_AND_NEAR)), Vote::default());
    }

    /// Every fix is refused, by little; nobody stands against the belief, and it is far less certain than they are.
    #[test]
    fn who_refuses_everything_for_ten_seconds_has_a_second_chance() {
        let covariance = Covariance3::diagonal([0.3, 0.3, 0.01]).unwrap();
        let belief = Belief::independent(Pose::default(), covariance);
        let drops_at = |trust_jump| {
            let mut settings = Settings::default();
            settings.found.trust_jump = trust_jump;
            let mut found = Found::new(Stamp::default(), &Start::Known(belief));
            for tick in 0..9 {
                let _ = found.hear(&fix(0, tick, 0.0, NEAR), &belief, &settings);
            }
            let out = Gauge { d2: 15.0, ..NEAR };
            let mut words = (9..80).map(|tick| fix(0, tick, 1.9, out));
            words.position(|word| found.hear(&word, &belief, &settings).0 == Ruling::Dropped)
        };
        assert_eq!(drops_at(TrustJump::Robot), Some(49));
        assert_eq!(drops_at(TrustJump::Receiver), None);
    }

    /// A receiver drags the belief along, and another one stands by that. Once it is named the belief is less sure of itself, and
    /// what the other one began to hold against it is forgotten.
    #[test]
    fn what_a_liar_dragged_along_is_doubted_when_it_is_named() {
        let covariance = Covariance3::diagonal([0.01, 0.01, 0.01]).unwrap();
        let belief = Belief::independent(Pose::default(), covariance);
        let settings = Settings::default();
        let mut found = Found::new(Stamp::default(), &Start::Known(belief));
        let dragged = |x: f64| Gauge {
            normalised: [x, 0.0],
            ..NEAR
        };
        let mut named = (0..100).map(|tick| {
            let _ = found.hear(&fix(1, tick, 0.0, dragged(-0.5)), &belief, &settings);
            let ruling = found
                .hear(&fix(0, tick, 0.0, dragged(1.5)), &belief, &settings)
                .0;
            (
                ruling,
                found.suspended().len(),
                found.seats[0].map(|it| it.mean),
            )
        });
        let (ruling, against, mean) = named.find(|(_, against, _)| *against > 0).unwrap();
        let Ruling::Replaced(wider) = ruling else {
            panic!("{ruling:?}");
        };
        let [x, y, heading] = wider.total().variances();
        assert!(x > 0.017 && x == y && heading == 0.01, "{x} {y} {heading}");
        assert_eq!((against, mean), (1, Some(mean::Mean::default())));
    }

    /// It stood when it was carried, and is where it was believed to be by chance: while its heading is open that means nothing.
    #[test]
    fn who_has_driven_and_does_not_know_its_heading_is_not_back() {
        let covariance = Covariance3::diagonal([0.01; 3]).unwrap();
        let belief = Belief::independent(Pose::default(), covariance);
        let mut stands = Hypothesis::beginning(&fix(0, 0, 0.0, NEAR), Span::ZERO);
        assert!(is_back(&stands, &belief));
        let ahead = Motion::Holonomic {
            velocity: [0.1, 0.0, 0.0],
            noise: Covariance3::default(),
        };
        stands.step(&Stride::of(&ahead, 1.0), 1.0);
        let _ = stands.feed(&fix(0, 5, 0.1, NEAR), 4.0);
        assert!(!is_back(&stands, &belief));
    }

    /// It is where the belief is, and looks where that looks as far as it knows: half a radian of doubt agrees with too much.
    #[test]
    fn who_hardly_knows_its_heading_is_not_back_and_who_does_is() {
        let is_back_with = |sigma: f64| {
            let covariance = Covariance3::diagonal([0.01, 0.01, sigma * sigma]).unwrap();
            let belief = Belief::independent(Pose::default(), covariance);
            let mut back = Hypothesis::from(
                &Lifted::of(&belief),
                Turned::default(),
                &fix(0, 0, 0.0, NEAR),
                Span::ZERO,
            );
            back.tellings = 9;
            is_back(&back, &belief)
        };
        assert!(is_back_with(0.2) && !is_back_with(0.3));
    }

    /// It was found by the way that it drove: that way confirms nothing. What comes later does.
    #[test]
    fn who_was_found_from_nowhere_is_on_trial_for_five_seconds() {
        let settings = Settings::default();
        let belief = Belief::independent(Pose::default(), Covariance3::default());
        let mut found = Found::new(Stamp::default(), &Start::Unknown);
        let ahead = Motion::Holonomic {
            velocity: [1.0, 0.0, 0.0],
            noise: Covariance3::default(),
        };
        let mut heard = (1..60_u32).map(|tick| {
            found.drive(&ahead, 0.2);
            let word = fix(0, tick.into(), 0.2 * f64::from(tick), NEAR);
            let _ = found.hear(&word, &belief, &settings);
            (found.knows, found.confirmed)
        });
        assert!(heard.any(|(knows, _)| knows));
        assert_eq!(heard.nth(23), Some((true, 0)));
        assert_eq!(heard.next(), Some((true, 1)));
        assert_eq!(heard.nth(4), Some((true, 6)));
    }

    /// One source and the wheels may be wrong together; two bear each other out.
    #[test]
    fn whom_two_sources_found_is_not_on_trial() {
        let settings = Settings::default();
        let belief = Belief::independent(Pose::default(), Covariance3::default());
        let mut found = Found::new(Stamp::default(), &Start::Unknown);
        let ahead = Motion::Holonomic {
            velocity: [1.0, 0.0, 0.0],
            noise: Covariance3::default(),
        };
        let mut heard = (1..60_u32).map(|tick| {
            found.drive(&ahead, 0.2);
            for receiver in 0..2 {
                let word = fix(receiver, tick.into(), 0.2 * f64::from(tick), NEAR);
                let _ = found.hear(&word, &belief, &settings);
            }
            (found.knows, found.is_confirmed())
        });
        assert_eq!(heard.find(|(knows, _)| *knows), Some((true, true)));
    }

    /// Its heading was too uncertain for a fix after an outage. If the wheels stood by what it believed before, they do again.
    #[test]
    fn who_goes_on_from_a_confirmed_belief_is_not_on_trial() {
        let settings = Settings::default();
        let covariance = Covariance3::diagonal([0.01, 0.01, 0.2]).unwrap();
        let belief = Belief::independent(Pose::default(), covariance);
        let ahead = Motion::Holonomic {
            velocity: [1.0, 0.0, 0.0],
            noise: Covariance3::default(),
        };
        let confirmed_when_found = |before: i64| {
            let mut found = Found::new(Stamp::default(), &Start::Known(belief));
            for tick in 0..before {
                let _ = found.hear(&fix(0, tick, 0.0, NEAR), &belief, &settings);
            }
            let _ = found.hear(&fix(0, before, 0.0, WIDE_AND_NEAR), &belief, &settings);
            assert!(!found.knows);
            let mut heard = (1..60_u32).map(|tick| {
                found.drive(&ahead, 0.2);
                let word = fix(0, before + i64::from(tick), 0.2 * f64::from(tick), NEAR);
                let _ = found.hear(&word, &belief, &settings);
                (found.knows, found.is_confirmed())
            });
            heard.find(|(knows, _)| *knows)
        };
        // The word that makes it a hypothesis is one that the belief takes.
        assert_eq!(confirmed_when_found(4), Some((true, true)));
        assert_eq!(confirmed_when_found(3), Some((true, false)));
    }

    /// A mean that is not yet enough for a name is as much doubt, if neighbours alone stand by the belief.
    #[test]
    fn a_mean_that_chance_hardly_explains_is_doubted_beside_neighbours() {
        let covariance = Covariance3::diagonal([0.001; 3]).unwrap();
        let belief = Belief::independent(Pose::default(), covariance);
        let settings = Settings::default();
        let dragged = Gauge {
            normalised: [0.8, 0.0],
            ..NEAR
        };
        let doubts = |beside: &dyn Fn(i64) -> Option<Word>| {
            let mut found = Found::new(Stamp::default(), &Start::Known(belief));
            (0..50).any(|tick| {
                if let Some(word) = beside(tick) {
                    let _ = found.hear(&word, &belief, &settings);
                }
                let ruling = found.hear(&fix(0, tick, 0.0, dragged), &belief, &settings);
                matches!(ruling.0, Ruling::Replaced(wider) if wider.total().variances()[0] > 0.003)
            })
        };
        assert!(doubts(&|tick| Some(neighbour(1, tick))));
        assert!(!doubts(&|tick| Some(fix(1, tick, 0.0, NEAR))) && !doubts(&|_| None));
    }

    /// It is refused soon after the start and ever since, and refusals count for next to nothing. It is not left so.
    #[test]
    fn who_has_hardly_taken_anything_has_a_second_chance_without_an_outage() {
        let covariance = Covariance3::diagonal([0.1, 0.1, 0.01]).unwrap();
        let belief = Belief::independent(Pose::default(), covariance);
        let settings = Settings::default();
        let drops_after = |taken: i64| {
            let mut found = Found::new(Stamp::default(), &Start::Known(belief));
            for tick in 0..taken {
                assert_eq!(
                    found.hear(&fix(0, tick, 0.0, NEAR), &belief, &settings).0,
                    Ruling::Stands
                );
            }
            let out = Gauge { d2: 15.0, ..NEAR };
            let mut words = (taken..taken + 4).map(|tick| fix(0, tick, 1.2, out));
            words.any(|word| found.hear(&word, &belief, &settings).0 == Ruling::Dropped)
        };
        assert!(drops_after(1) && !drops_after(9));
    }
}
