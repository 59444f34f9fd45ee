//! What the team knows together, and the leader's joint update.
//!
//! A [`Round`] holds for each robot its newest correction, and for each pair `C_lm`, their covariance, l at l's last round and m at m's. At
//! a slot the leader has the shares of some of the robots. Those take part whose last round is the one that the team has for them:
//!
//! ```text
//! P_lm = Ψ_l C_lm Ψ_mᵀ                                   the joint of those who take part, S
//! sightings between them, then fixes, one after the other, each gated and linearised where the last one led
//! C_lS ← (C_lS Ψ_Sᵀ)(I − K_S H_S)ᵀ                        of l outside of S, which is left out exactly: K_l = 0
//! ```
//!
//! A robot that joins shares nothing that is known with anybody. It gets a *block bound*: with k that join beside others everything is
//! multiplied by k + 1 (the joining robots' P, the others' P and C), and what joins is uncorrelated. Robots that are absent meanwhile
//! have their P multiplied when they take part again; that is no more than they need, because P has only grown.

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use nalgebra::{Matrix2, Matrix3};

use crate::joint::{Joint, Outcome};
use crate::model::Kind;
use coloc_estimator::rounds::{Correction, Shared, Standing};

/// A robot of the team, from 0.
pub type Robot = usize;

/// What a robot measured at the slot: of itself, or of another.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sighting {
    /// What it is of.
    pub kind: Kind,
    /// Who is seen; of no meaning where there is nobody.
    pub observed: Robot,
    /// The measurement, zero beyond its dimension.
    pub y: [f64; 3],
    /// R
    pub noise: Matrix3<f64>,
    /// How long before the slot who was seen was there, negative: after it \[s\]. Who sees it is taken to the slot already.
    pub age_s: f64,
}

/// How a robot moves at a slot.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Going {
    /// `[v_x, v_y, ω]` in its body frame \[m/s, m/s, rad/s\].
    pub velocity: [f64; 3],
    /// How fast the error of its way grows \[m²/s, m·rad/s, rad²/s\].
    pub noise: Matrix3<f64>,
}

/// What a robot tells the leader at a slot.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// Who.
    pub robot: Robot,
    /// What it believes.
    pub shared: Shared,
    /// How it moves.
    pub going: Going,
    /// What it sees.
    pub sightings: Vec<Sighting>,
}

/// What the team has of one robot.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its newest correction.
    pub correction: Correction,
    /// By how much its P has to be multiplied when it takes part again.
    pub owed: f64,
}

/// What came of a sighting in a round.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Who saw.
    pub observer: Robot,
    /// What it saw.
    pub sighting: Sighting,
    /// Accepted or not.
    pub outcome: Outcome,
}

/// What everybody keeps.
#[derive(Clone, Debug, PartialEq)]
pub struct Round {
    /// The slot that it is of, its name: there is one leader a slot at most.
    pub slot: u64,
    /// Who made it.
    pub leader: Robot,
    /// One for each robot of the team; `None` for one that never took part.
    pub entries: Vec<Option<Entry>>,
    /// `C_lm`, l < m, row by row of pairs.
    cross: Vec<Matrix3<f64>>,
}

/// How a leader gates, χ² by the dimension of the measurement, 1 to 3.
pub type Gates = [f64; 3];

impl Round {
    /// Of a team of `robots` in which nobody has taken part in anything.
    #[must_use]
    pub fn beginning(robots: usize) -> Self {
        Self {
            slot: 0,
            leader: 0,
            entries: vec![None; robots],
            cross: vec![Matrix3::zeros(); robots * robots.saturating_sub(1) / 2],
        }
    }

    /// Of a team that begins together, as if all had taken part in slot 0: independent of one another.
    #[must_use]
    pub fn together(robots: &[(Pose, Matrix3<f64>)]) -> Self {
        let entry = |(pose, covariance): &(Pose, Matrix3<f64>)| {
            Some(Entry {
                correction: Correction {
                    slot: 0,
                    pose: *pose,
                    covariance: *covariance,
                    factor: 1.0,
                },
                owed: 1.0,
            })
        };
        Self {
            entries: robots.iter().map(entry).collect(),
            ..Self::beginning(robots.len())
        }
    }

    /// Robots in the team.
    #[must_use]
    pub fn robots(&self) -> usize {
        self.entries.len()
    }

    /// Numbers in it, of eight bytes: of each robot its pose, the upper triangle of P, slot and factor; of each pair nine.
    #[must_use]
    pub fn numbers(&self) -> usize {
        11 * self.robots() + 9 * self.cross.len() + 8
    }

    /// What `robot`'s cross-covariances refer to; `None` if it never took part.
    #[must_use]
    pub fn last(&self, robot: Robot) -> Option<u64> {
        Some(self.entries.get(robot)?.as_ref()?.correction.slot)
    }

    /// The newest correction of `robot`.
    #[must_use]
    pub fn correction(&self, robot: Robot) -> Option<&Correction> {
        self.entries.get(robot)?.as_ref().map(|it| &it.correction)
    }

    /// `C_lm`, l < m, row by row of pairs.
    #[must_use]
    pub fn crosses(&self) -> &[Matrix3<f64>] {
        &self.cross
    }

    /// As somebody said it; `None` if there is not one block for each pair.
    #[must_use]
    pub fn from_parts(
        slot: u64,
        leader: Robot,
        entries: Vec<Option<Entry>>,
        cross: Vec<Matrix3<f64>>,
    ) -> Option<Self> {
        let robots = entries.len();
        let is_whole = cross.len() == robots * robots.saturating_sub(1) / 2 && leader < robots;
        is_whole.then_some(Self {
            slot,
            leader,
            entries,
            cross,
        })
    }

    fn index(&self, l: Robot, m: Robot) -> usize {
        let (low, high) = (l.min(m), l.max(m));
        low * self.robots() - low * (low + 1) / 2 + high - low - 1
    }

    /// `C_lm` of two different robots.
    #[must_use]
    pub fn cross(&self, l: Robot, m: Robot) -> Matrix3<f64> {
        let block = self.cross[self.index(l, m)];
        if l < m { block } else { block.transpose() }
    }

    fn set_cross(&mut self, l: Robot, m: Robot, block: Matrix3<f64>) {
        let index = self.index(l, m);
        self.cross[index] = if l < m { block } else { block.transpose() };
    }

    /// How a share stands to what the team has.
    #[must_use]
    pub fn part(&self, share: &Share) -> Part {
        match (share.shared.standing, self.last(share.robot)) {
            (Standing::Since(slot), Some(last)) if slot == last => Part::Member,
            (Standing::Joining(from), last) if last.is_none_or(|last| last < from) => Part::Joins,
            _ => Part::None,
        }
    }

    /// The round that `leader` makes of the shares of `slot`; a verdict for each sighting between those who take part. `None` if nobody
    /// does.
    ///
    /// Shares that say what is no belief are left out, as are all but the first of one robot.
    #[must_use]
    pub fn next(
        &self,
        slot: u64,
        leader: Robot,
        shares: &[Share],
        gates: &Gates,
    ) -> Option<(Self, Vec<Verdict>)> {
        let mut taking: Vec<&Share> = shares
            .iter()
            .filter(|share| share.shared.slot == slot && share.robot < self.robots())
            .filter(|share| self.part(share) != Part::None && is_belief(&share.shared))
            .collect();
        taking.sort_by_key(|share| share.robot);
        taking.dedup_by_key(|share| share.robot);
        if taking.is_empty() {
            return None;
        }
        let factor = self.factor(&taking);
        let mut joint = self.joint(&taking, factor);
        let absent: Vec<Robot> = (0..self.robots())
            .filter(|robot| taking.iter().all(|share| share.robot != *robot))
            .collect();
        for &robot in &absent {
            let blocks: Vec<_> = taking
                .iter()
                .map(|share| self.seen_from(robot, share) * factor)
                .collect();
            joint.consider(&blocks);
        }
        let verdicts = update(&mut joint, &taking, gates);
        let mut round = self.clone();
        (round.slot, round.leader) = (slot, leader);
        round.take(&joint, &taking, &absent, slot, factor);
        Some((round, verdicts))
    }

    /// The block bound's: one more than those who join, if there are others at all.
    fn factor(&self, taking: &[&Share]) -> f64 {
        let joins = taking
            .iter()
            .filter(|share| self.part(share) == Part::Joins);
        let joining: Vec<Robot> = joins.map(|share| share.robot).collect();
        if joining.is_empty() {
            return 1.0;
        }
        let others =
            (0..self.robots()).any(|it| self.entries[it].is_some() && !joining.contains(&it));
        #[allow(clippy::cast_precision_loss)] // A team is small.
        let groups = (joining.len() + usize::from(others)) as f64;
        groups
    }

    fn owed(&self, share: &Share) -> f64 {
        match (self.part(share), &self.entries[share.robot]) {
            (Part::Member, Some(entry)) => entry.owed,
            _ => 1.0,
        }
    }

    /// `C_l,m Ψ_mᵀ`, zero if m joins.
    fn seen_from(&self, robot: Robot, share: &Share) -> Matrix3<f64> {
        match self.part(share) {
            Part::Member => self.cross(robot, share.robot) * share.shared.psi.transpose(),
            Part::Joins | Part::None => Matrix3::zeros(),
        }
    }

    fn joint(&self, taking: &[&Share], factor: f64) -> Joint {
        let robots: Vec<(Pose, Matrix3<f64>)> = taking
            .iter()
            .map(|share| {
                let Shared {
                    pose, covariance, ..
                } = share.shared;
                (pose, covariance * (factor * self.owed(share)))
            })
            .collect();
        let mut joint = Joint::new(&robots);
        for (l, first) in taking.iter().enumerate() {
            for (m, second) in taking.iter().enumerate().skip(l + 1) {
                if self.part(first) == Part::Member && self.part(second) == Part::Member {
                    let block = first.shared.psi * self.seen_from(first.robot, second);
                    joint.set_block(l, m, &(block * factor));
                }
            }
        }
        joint
    }

    fn take(&mut self, joint: &Joint, taking: &[&Share], absent: &[Robot], slot: u64, factor: f64) {
        for (index, &l) in absent.iter().enumerate() {
            self.owe(l, factor);
            for &m in &absent[index + 1..] {
                self.set_cross(l, m, self.cross(l, m) * factor);
            }
            for (m, share) in taking.iter().enumerate() {
                self.set_cross(l, share.robot, joint.considered(index, m));
            }
        }
        for (l, share) in taking.iter().enumerate() {
            for (m, other) in taking.iter().enumerate().skip(l + 1) {
                self.set_cross(share.robot, other.robot, joint.block(l, m));
            }
            // By so much it may find itself less certain than it said: the bound, and what it owed.
            let allowed = factor * self.owed(share);
            self.entries[share.robot] = Some(Entry {
                correction: Correction {
                    slot,
                    pose: joint.pose(l),
                    covariance: joint.block(l, l),
                    factor: allowed,
                },
                owed: 1.0,
            });
        }
    }
}

impl Round {
    /// Who owes more than a block bound of the whole team would be has to join again.
    fn owe(&mut self, robot: Robot, factor: f64) {
        #[allow(clippy::cast_precision_loss)] // A team is small.
        let most = self.robots() as f64;
        if let Some(entry) = &mut self.entries[robot] {
            entry.owed *= factor;
            if entry.owed > most {
                self.entries[robot] = None;
            }
        }
    }
}

/// How a share stands to what the team has.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Part {
    /// Its last round is the one that the team has for it.
    Member,
    /// It takes part for the first time since what it shared with others is unknown.
    Joins,
    /// It missed its own correction, or has one that the team has not.
    None,
}

fn is_belief(shared: &Shared) -> bool {
    let psi_is_finite = shared.psi.iter().all(|it| it.is_finite());
    let is_covariance = coloc_estimator::Covariance3::new(shared.covariance).is_ok();
    shared.pose.is_finite() && psi_is_finite && is_covariance
}

/// Where who is seen is at the slot: it has gone on since, or had not come so far, by its own wheels. Of another kind than a pose only one of the
/// slot itself is as it is.
///
/// `y ← y ∘ v a, R ← R + Γ N Γᵀ |a|` with the age a and Γ of y's heading.
fn brought(sighting: &Sighting, going: &Going) -> Sighting {
    let age_s = sighting.age_s;
    if age_s == 0.0 || sighting.kind != Kind::Pose {
        return *sighting;
    }
    let [x, y, phi] = sighting.y;
    let [vx, vy, omega] = going.velocity.map(|it| it * age_s);
    let (s, c) = libm::sincos(phi + 0.5 * omega);
    let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    Sighting {
        y: [x + c * vx - s * vy, y + s * vx + c * vy, wrap(phi + omega)],
        noise: sighting.noise + turn * going.noise * turn.transpose() * age_s.abs(),
        age_s: 0.0,
        ..*sighting
    }
}

/// Sightings first, ascending in who saw and who was seen; then what robots measured of themselves.
fn update(joint: &mut Joint, taking: &[&Share], gates: &Gates) -> Vec<Verdict> {
    let place = |robot: Robot| taking.iter().position(|share| share.robot == robot);
    let mut measured: Vec<(bool, usize, usize, Sighting)> = Vec::new();
    for (a, share) in taking.iter().enumerate() {
        for sighting in &share.sightings {
            let of_two = sighting.kind.is_of_two();
            let other = if of_two {
                place(sighting.observed)
            } else {
                Some(a)
            };
            if let Some(b) = other.filter(|b| !of_two || *b != a) {
                let going = &taking[b].going;
                let sighting = if of_two {
                    brought(sighting, going)
                } else {
                    *sighting
                };
                measured.push((!of_two, a, b, sighting));
            }
        }
    }
    measured.sort_by_key(|(own, a, b, _)| (*own, *a, *b));
    measured
        .into_iter()
        .map(|(_, a, b, sighting)| {
            let Sighting { kind, y, noise, .. } = sighting;
            let gate = gates[kind.dimension() - 1];
            let outcome = match kind {
                Kind::Pose => {
                    let seen = Pose::new(y[0], y[1], y[2]);
                    joint.relative_pose([a, b], &seen, &noise, gate)
                }
                Kind::Position => {
                    let noise: Matrix2<f64> = noise.fixed_view::<2, 2>(0, 0).into_owned();
                    joint.position(a, [y[0], y[1]], &noise, gate)
                }
                _ => joint.measure(kind, [a, b], y, &noise, gate),
            };
            Verdict {
                observer: taking[a].robot,
                sighting,
                outcome,
            }
        })
        .collect()
}
