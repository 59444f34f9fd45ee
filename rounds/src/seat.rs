//! A robot's seat among those who make rounds: its party, what it sees, and what `colocd` is to do.

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use coloc_estimator::rounds::{Correction, Shared, Standing};
use nalgebra::Matrix3;

use crate::model::Kind;
use crate::party::{Advice, Message, Party, Post, Rules, advice};
use crate::round::{Going, Robot, Round, Share, Sighting, Verdict};

/// What the robot's `colocd` says at a slot.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Told {
    /// It takes no part.
    Apart,
    /// It does not know where it is.
    Nowhere,
    /// This.
    Belief(Shared),
}

/// What is to be said.
#[derive(Clone, Debug, PartialEq)]
pub enum Word {
    /// To the others.
    Post(Post),
    /// To the robot's own `colocd`.
    Deed(Deed),
}

/// What the robot's `colocd` is to do.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Deed {
    /// The belief at the correction's slot is replaced.
    Correct(Correction),
    /// What rounds of later slots did is taken back, of all if there is none.
    Undo(Option<u64>),
    /// Take part.
    Join,
    /// Take part no more.
    Leave,
}

/// What this robot saw.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Seen {
    /// When, by the common clock \[ns\].
    pub stamp_ns: i64,
    /// Whom.
    pub observed: Robot,
    /// Its pose in this robot's body frame.
    pub pose: Pose,
    /// R
    pub noise: Matrix3<f64>,
}

/// Sightings are kept for so long \[ns\]: a slot is told within.
const KEPT_NS: i64 = 1_000_000_000;

/// More are never kept.
const MOST_SEEN: usize = 256;

/// A share carries so many.
const MOST_SHARED: usize = 16;

/// A correction that was said has been refused if so many slots later what the robot shares is still of before it.
const PATIENCE: u32 = 2;

/// Messages of a slot that this robot has not begun yet: its tick is a little later than the others'.
const MOST_EARLY: usize = 64;

/// How often what happened.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Slots at which `colocd` shared a belief.
    pub shared: u64,
    /// Rounds that this robot made.
    pub led: u64,
    /// Rounds that it followed.
    pub followed: u64,
    /// Rounds that it took back.
    pub undone: u64,
    /// How often it had to join.
    pub joined: u64,
    /// Corrections that `colocd` did not take.
    pub refused: u64,
    /// Sightings in rounds that it made, and those of them that the gate refused.
    pub sightings: [u64; 2],
}

/// The seat.
#[derive(Clone, Debug)]
pub struct Seat {
    me: Robot,
    party: Party,
    skew_ns: i64,
    seen: Vec<Seen>,
    going: Going,
    standing: Option<Standing>,
    slot: u64,
    /// The correction that was said last, and slots since then.
    said: Option<(u64, u32)>,
    undone: Option<u64>,
    /// Of a slot that the robot itself has not begun.
    early: Vec<Message>,
    counts: Counts,
}

impl Seat {
    /// Of robot `me` of a team, which knows nothing yet.
    #[must_use]
    pub fn new(me: Robot, rules: Rules, skew_ns: i64) -> Self {
        Self {
            me,
            party: Party::new(me, rules),
            skew_ns,
            seen: Vec::new(),
            going: Going::default(),
            standing: None,
            slot: 0,
            said: None,
            undone: None,
            early: Vec::new(),
            counts: Counts::default(),
        }
    }

    /// How often what happened.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// What the robot's cross-covariances refer to, as it last said.
    #[must_use]
    pub fn standing(&self) -> Option<Standing> {
        self.standing
    }

    /// The present slot.
    #[must_use]
    pub fn slot(&self) -> u64 {
        self.slot
    }

    /// The newest round that it knows.
    #[must_use]
    pub fn round(&self) -> &Round {
        self.party.round()
    }

    /// How the robot moves.
    pub fn go(&mut self, going: Going) {
        self.going = going;
    }

    /// The robot has seen another one.
    pub fn see(&mut self, seen: Seen) {
        let oldest_ns = seen.stamp_ns.saturating_sub(KEPT_NS);
        self.seen.retain(|it| it.stamp_ns >= oldest_ns);
        if self.seen.len() < MOST_SEEN {
            self.seen.push(seen);
        }
    }

    /// What `colocd` says at `slot`, which began at `begin_ns` of the common clock; `now_ns` is of any clock that goes on evenly.
    pub fn share(&mut self, now_ns: i64, (slot, begin_ns): (u64, i64), told: &Told) -> Vec<Word> {
        self.slot = slot;
        let mut words = Vec::new();
        let Told::Belief(shared) = told else {
            self.standing = None;
            if *told == Told::Apart {
                self.join(&mut words);
            }
            return words;
        };
        self.counts.shared += 1;
        self.standing = Some(shared.standing);
        if self.is_refused(shared.standing) || self.party.has_to_join(shared.standing) {
            self.join(&mut words);
            return words;
        }
        let share = Share {
            robot: self.me,
            shared: *shared,
            going: self.going,
            sightings: self.sightings(begin_ns),
        };
        self.act(&mut words, |party, post| party.begin(now_ns, share, post));
        for message in std::mem::take(&mut self.early) {
            words.extend(self.hear(now_ns, &message));
        }
        words
    }

    /// What another one says.
    pub fn hear(&mut self, now_ns: i64, message: &Message) -> Vec<Word> {
        let mut words = Vec::new();
        let is_early = slot_of(message).is_some_and(|slot| slot > self.slot);
        if is_early && self.early.len() < MOST_EARLY {
            self.early.push(message.clone());
        }
        self.act(&mut words, |party, post| party.hear(now_ns, message, post));
        words
    }

    /// Time passes.
    pub fn tick(&mut self, now_ns: i64) -> Vec<Word> {
        let mut words = Vec::new();
        self.act(&mut words, |party, post| party.tick(now_ns, post));
        words
    }

    fn act(
        &mut self,
        words: &mut Vec<Word>,
        action: impl FnOnce(&mut Party, &mut Vec<Post>) -> Vec<Verdict>,
    ) {
        let mut post = Vec::new();
        let verdicts = action(&mut self.party, &mut post);
        let made = |post: &Post| post.to.is_none() && matches!(post.message, Message::Round(_));
        self.counts.led += post.iter().filter(|it| made(it)).count() as u64;
        let refused = verdicts.iter().filter(|it| !it.outcome.accepted).count();
        self.counts.sightings[0] += verdicts.len() as u64;
        self.counts.sightings[1] += refused as u64;
        words.extend(post.into_iter().map(Word::Post));
        self.follow(words);
    }

    fn follow(&mut self, words: &mut Vec<Word>) {
        let Some(standing) = self.standing else {
            return;
        };
        let round = self.party.round();
        match advice(round, self.me, standing) {
            Advice::Correct(told) if self.said.is_none_or(|(slot, _)| slot != told.slot) => {
                self.said = Some((told.slot, 0));
                self.counts.followed += 1;
                words.push(Word::Deed(Deed::Correct(told)));
            }
            Advice::Undo(last) if self.undone != Some(round.slot) => {
                self.undone = Some(round.slot);
                self.said = None;
                self.counts.undone += 1;
                words.push(Word::Deed(Deed::Undo(last)));
            }
            Advice::Correct(_) | Advice::Undo(_) | Advice::Nothing => {}
        }
    }

    /// Whether the correction that was said did nothing.
    fn is_refused(&mut self, standing: Standing) -> bool {
        let Some((slot, slots)) = &mut self.said else {
            return false;
        };
        let is_taken = match standing {
            Standing::Since(last) => last >= *slot,
            // Whatever was said before it began to join is of no meaning any more.
            Standing::Joining(from) => from > *slot,
        };
        if is_taken {
            self.said = None;
            return false;
        }
        *slots += 1;
        let is_refused = *slots >= PATIENCE;
        self.counts.refused += u64::from(is_refused);
        is_refused
    }

    fn join(&mut self, words: &mut Vec<Word>) {
        self.said = None;
        self.standing = None;
        self.counts.joined += 1;
        words.push(Word::Deed(Deed::Join));
    }

    /// Of each robot the nearest to the slot, taken there by this robot's own wheels.
    fn sightings(&self, begin_ns: i64) -> Vec<Sighting> {
        let away = |it: &Seen| it.stamp_ns.saturating_sub(begin_ns).saturating_abs();
        let mut near: Vec<&Seen> = self.seen.iter().collect();
        near.retain(|it| away(it) <= self.skew_ns && it.observed != self.me);
        near.sort_by_key(|it| (it.observed, away(it), it.stamp_ns));
        near.dedup_by_key(|it| it.observed);
        near.truncate(MOST_SHARED);
        let taken = near
            .into_iter()
            .map(|it| at_slot(it, begin_ns, &self.going));
        taken.collect()
    }
}

/// The present slot of who says it, where that matters.
fn slot_of(message: &Message) -> Option<u64> {
    match message {
        Message::Hello { slot, .. } => Some(*slot),
        Message::Share { share, .. } => Some(share.shared.slot),
        Message::Round(_) | Message::Ask { .. } => None,
    }
}

/// `y ← (v a)⁻¹ ∘ y`, `R ← T (R + L N Lᵀ |a|) Tᵀ`, a the age.
#[allow(clippy::cast_precision_loss)] // A second at most.
fn at_slot(seen: &Seen, begin_ns: i64, going: &Going) -> Sighting {
    let age_s = begin_ns.saturating_sub(seen.stamp_ns) as f64 * 1e-9;
    let [vx, vy, omega] = going.velocity.map(|it| it * age_s);
    let (s, c) = libm::sincos(0.5 * omega);
    let Pose { x, y, phi } = seen.pose;
    let [x, y] = [x - (c * vx - s * vy), y - (s * vx + c * vy)];
    let (s, c) = libm::sincos(-omega);
    let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    let lever = Matrix3::new(1.0, 0.0, -y, 0.0, 1.0, x, 0.0, 0.0, 1.0);
    let added = lever * going.noise * lever.transpose() * age_s.abs();
    Sighting {
        kind: Kind::Pose,
        observed: seen.observed,
        y: [c * x - s * y, s * x + c * y, wrap(phi - omega)],
        noise: turn * (seen.noise + added) * turn.transpose(),
        age_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seat() -> Seat {
        let rules = Rules {
            robots: 2,
            hello_ns: 40,
            deadline_ns: 100,
            patience: 4,
            gates: [7.0, 9.0, 11.0],
        };
        Seat::new(0, rules, 50_000_000)
    }

    fn belief(slot: u64, standing: Standing) -> Told {
        Told::Belief(Shared {
            slot,
            pose: Pose::default(),
            covariance: Matrix3::identity() * 0.01,
            psi: Matrix3::identity(),
            standing,
        })
    }

    fn deeds(words: &[Word]) -> Vec<Deed> {
        let deeds = words.iter().filter_map(|it| match it {
            Word::Deed(deed) => Some(*deed),
            Word::Post(_) => None,
        });
        deeds.collect()
    }

    #[test]
    fn who_is_apart_is_asked_to_join_and_who_is_nowhere_is_left_alone() {
        let mut seat = seat();
        assert_eq!(deeds(&seat.share(0, (5, 0), &Told::Apart)), [Deed::Join]);
        assert_eq!(seat.share(1, (6, 0), &Told::Nowhere), []);
        assert_eq!(seat.counts().shared, 0);
    }

    /// Half of the team with the lowest number is enough: it makes rounds alone.
    #[test]
    fn a_correction_is_said_once_and_one_that_is_not_taken_leads_to_joining() {
        let mut seat = seat();
        let joining = Standing::Joining(5);
        assert_eq!(deeds(&seat.share(0, (5, 0), &belief(5, joining))), []);
        let told = deeds(&seat.tick(100));
        assert!(matches!(
            told[..],
            [Deed::Correct(Correction { slot: 5, .. })]
        ));
        assert_eq!(deeds(&seat.tick(101)), []);
        assert_eq!(deeds(&seat.share(500, (6, 0), &belief(6, joining))), []);
        assert_eq!(
            deeds(&seat.share(1000, (7, 0), &belief(7, joining))),
            [Deed::Join]
        );
        assert_eq!(seat.counts().refused, 1);
    }

    /// Both drive past each other; seen 40 ms before the slot.
    #[test]
    fn a_sighting_is_taken_to_the_slot_by_the_wheels() {
        let mut seat = seat();
        seat.go(Going {
            velocity: [1.0, 0.0, 0.5],
            noise: Matrix3::identity() * 0.01,
        });
        let seen = |stamp_ns, observed| Seen {
            stamp_ns,
            observed,
            pose: Pose::new(3.0, 1.0, 0.2),
            noise: Matrix3::identity() * 1e-3,
        };
        for (stamp_ns, observed) in [(-60_000_000, 1), (-40_000_000, 1), (45_000_000, 1), (0, 0)] {
            seat.see(seen(stamp_ns, observed));
        }
        let [taken] = seat.sightings(0)[..] else {
            panic!("one");
        };
        assert_eq!((taken.observed, taken.age_s), (1, 0.04));
        let (s, c) = libm::sincos(-0.02);
        let [x, y] = [3.0 - 0.04, 1.0];
        let expected = [c * x - s * y, s * x + c * y, 0.18];
        for (is, should) in taken.y.iter().zip(expected) {
            assert!((is - should).abs() < 5e-4, "{:?}", taken.y);
        }
        assert!(taken.noise[(1, 1)] > 1e-3 + 4e-4 * 9.0);
    }
}
