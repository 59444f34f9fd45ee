//! A team that makes rounds: a [`Member`] and a [`Party`] a robot, over a simulated network.

use std::sync::Arc;

use coloc_estimator::{Belief, Motion, Pose};
use coloc_rounds::gate::Refusal;
use coloc_rounds::member::Settings as MemberSettings;
use coloc_rounds::model::Kind;
use coloc_rounds::party::follow;
use coloc_rounds::round::Verdict;
use coloc_rounds::{
    Going, Member, Message, Party, Post, Round, Rules, Share, Shared, Sighting, Standing, Taken,
};
use nalgebra::Matrix3;

use super::network::{Network, Trouble};
use crate::method::wheels::Wheels;
use crate::method::{FilterSettings, Innovation, Method, Sensor, Sent};
use crate::sensors::{Fix, StepInputs};

/// χ² with one degree of freedom, 99 %, and with two and three.
const GATE_OF_ONE: f64 = coloc_estimator::gate::CHI2_1_99;

/// What is done at which rate.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Plan {
    /// Rounds \[Hz\].
    pub rate_hz: f64,
    /// Whether fixes wait for the next round instead of being silent.
    pub fixes_in_rounds: bool,
    /// From a slot until everybody shares, and until the round is made \[s\].
    pub wait_s: [f64; 2],
    /// Entries of a robot's history.
    pub history: usize,
    /// χ² of corrections.
    pub correction_gate: f64,
    /// What goes wrong.
    pub trouble: Trouble,
    /// Whether everything is written down that [`reference`](super::reference) needs.
    pub keeps_log: bool,
}

impl Plan {
    /// Rounds at `rate_hz`, nothing wrong.
    #[must_use]
    pub fn at(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            fixes_in_rounds: false,
            wait_s: [0.04, 0.1],
            history: 512,
            correction_gate: coloc_rounds::gate::CHI2_3_ONE_IN_A_MILLION,
            trouble: Trouble::default(),
            keeps_log: false,
        }
    }
}

/// How often what happened.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rounds that a leader made.
    pub rounds: u64,
    /// Corrections in the history.
    pub exact: u64,
    /// Corrections after it.
    pub first_order: u64,
    /// Refused by the gate …
    pub refused: u64,
    /// … and the last of them, why.
    pub last_refusal: Option<Refusal>,
    /// Rounds that were taken back.
    pub undone: u64,
    /// Robots that had to join again.
    pub joined: u64,
}

/// What happened at a step.
#[derive(Clone, Debug)]
pub(super) struct Logged {
    pub(super) motions: Vec<Motion>,
    pub(super) fixes: Vec<Fix>,
    /// Of each robot, at slots.
    pub(super) shares: Vec<Share>,
}

/// A round, and what it was made of.
#[derive(Clone, Debug)]
pub(super) struct Made {
    pub(super) parent: u64,
    pub(super) round: Arc<Round>,
}

/// The team.
#[derive(Clone, Debug)]
pub struct Crew {
    settings: FilterSettings,
    plan: Plan,
    /// Steps from slot to slot.
    every: usize,
    rules: Rules,
    members: Vec<Member>,
    parties: Vec<Option<Party>>,
    /// The slot up to which each robot has followed its party's round.
    followed: Vec<Option<u64>>,
    wheels: Vec<Wheels>,
    network: Network,
    counts: Counts,
    waiting_fixes: Vec<Fix>,
    slot: u64,
    pub(super) log: Vec<Logged>,
    pub(super) made: Vec<Made>,
}

impl Crew {
    /// A team that begins at `initial`, together.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A few steps.
    pub fn new(settings: FilterSettings, initial: &[Belief], plan: Plan) -> Self {
        let robots = initial.len();
        let member = MemberSettings {
            robots,
            fix_gate: settings.product.position_gate,
            correction_gate: plan.correction_gate,
            history: plan.history,
        };
        let [hello_ns, deadline_ns] = plan.wait_s.map(|it| (it * 1e9) as i64);
        let product = &settings.product;
        let rules = Rules {
            robots,
            hello_ns,
            deadline_ns,
            patience: 4,
            gates: [GATE_OF_ONE, product.position_gate, product.fusion.gate],
        };
        let beliefs: Vec<(Pose, Matrix3<f64>)> = initial
            .iter()
            .map(|it| (it.pose, it.total().matrix()))
            .collect();
        let round = Arc::new(Round::together(&beliefs));
        let party = |robot| Some(Party::knowing(robot, rules, round.clone()));
        let member =
            |belief: &(Pose, Matrix3<f64>)| Member::new(member, 0, *belief, Standing::Since(0));
        Self {
            every: ((1.0 / plan.rate_hz / settings.dt_s).round() as usize).max(1),
            members: beliefs.iter().map(member).collect(),
            parties: (0..robots).map(party).collect(),
            followed: vec![Some(0); robots],
            wheels: vec![Wheels::default(); robots],
            network: Network::new(robots, settings.radio, plan.trouble, settings.noise.clone()),
            counts: Counts::default(),
            waiting_fixes: Vec::new(),
            slot: 0,
            log: Vec::new(),
            made: Vec::new(),
            settings,
            plan,
            rules,
        }
    }

    /// How often what happened.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The rounds that the team followed, the oldest first: the newest that anybody knows, and those that it was made from.
    pub(super) fn line(&self) -> Vec<Arc<Round>> {
        let parties = self.parties.iter().flatten();
        let mut slot = parties.map(|party| party.round().slot).max();
        let mut line = Vec::new();
        for made in self.made.iter().rev() {
            if slot == Some(made.round.slot) {
                line.push(made.round.clone());
                slot = Some(made.parent);
            }
        }
        line.reverse();
        line
    }

    /// Gates of sightings by their dimension.
    #[must_use]
    pub fn gates(&self) -> [f64; 3] {
        self.rules.gates
    }

    fn now_ns(&self, step: usize) -> i64 {
        self.settings.stamp(step).as_nanos()
    }

    fn drive(&mut self, inputs: &StepInputs) -> Vec<Motion> {
        let now_ns = self.now_ns(inputs.step);
        let mut motions = Vec::with_capacity(self.members.len());
        for (robot, reported) in inputs.odometry.iter().enumerate() {
            let motion = self.wheels[robot].motion(*reported, &self.settings);
            self.members[robot].drive(now_ns, motion, self.settings.dt_s);
            motions.push(motion);
        }
        motions
    }

    fn fix(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        if self.plan.fixes_in_rounds {
            self.waiting_fixes.clone_from(&inputs.fixes);
            return;
        }
        let now_ns = self.now_ns(inputs.step);
        for fix in &inputs.fixes {
            let member = &mut self.members[fix.robot];
            let outcome = member.fix(now_ns, fix.position, self.settings.fix);
            log(Innovation {
                sensor: Sensor::Fix,
                robot: fix.robot,
                accepted: outcome.accepted,
                d2: outcome.d2,
            });
        }
    }

    fn sightings(&self, robot: usize, inputs: &StepInputs) -> Vec<Sighting> {
        let noise = self.settings.relative.matrix();
        let own = inputs.sightings.iter().filter(|it| it.observer == robot);
        let seen = own.map(|seen| Sighting {
            kind: Kind::Pose,
            observed: seen.observed,
            y: seen.relative.to_vector().into(),
            noise,
            age_s: 0.0,
        });
        let fix = self.settings.fix.matrix();
        let of_fix = Matrix3::new(fix.m11, fix.m12, 0.0, fix.m21, fix.m22, 0.0, 0.0, 0.0, 0.0);
        let fixes = self.waiting_fixes.iter().filter(|it| it.robot == robot);
        let fixes = fixes.map(|fix| Sighting {
            kind: Kind::Position,
            observed: robot,
            y: [fix.position[0], fix.position[1], 0.0],
            noise: of_fix,
            age_s: 0.0,
        });
        seen.chain(fixes).collect()
    }

    fn begin_slot(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) -> Vec<Share> {
        self.slot = (inputs.step / self.every) as u64;
        let now_ns = self.now_ns(inputs.step);
        let mut shares = Vec::new();
        for robot in 0..self.members.len() {
            if self.restarts(robot, now_ns) {
                self.members[robot].join(self.slot);
                self.counts.joined += 1;
            }
            let rules = self.rules;
            // Who was killed is back at the next slot.
            let party = self.parties[robot].get_or_insert_with(|| Party::new(robot, rules));
            let member = &mut self.members[robot];
            if party.has_to_join(member.standing()) {
                member.join(self.slot);
                self.counts.joined += 1;
            }
            let shared: Shared = member.share(self.slot);
            shares.push(Share {
                robot,
                shared,
                going: Going::default(),
                sightings: self.sightings(robot, inputs),
            });
        }
        for share in &shares {
            let robot = share.robot;
            if self.network.is_here(self.slot, robot) {
                self.act(robot, now_ns, log, &mut |party, post| {
                    party.begin(now_ns, share.clone(), post)
                });
            }
        }
        shares
    }

    #[allow(clippy::cast_precision_loss)] // Hours in nanoseconds.
    fn restarts(&self, robot: usize, now_ns: i64) -> bool {
        let period_ns = self.every as f64 * self.settings.dt_s * 1e9;
        self.plan.trouble.restart.is_some_and(|(who, at_s)| {
            who == robot && (0.0..period_ns).contains(&(now_ns as f64 - at_s * 1e9))
        })
    }

    /// Lets a robot's party do something, sends what it has to say, and has its member follow.
    fn act(
        &mut self,
        robot: usize,
        now_ns: i64,
        log: &mut dyn FnMut(Innovation),
        action: &mut dyn FnMut(&mut Party, &mut Vec<Post>) -> Vec<Verdict>,
    ) {
        let Some(party) = &mut self.parties[robot] else {
            return;
        };
        let parent = party.round().slot;
        let mut post = Vec::new();
        let verdicts = action(party, &mut post);
        let round = party.round().clone();
        let is_made = |post: &Post| matches!(post.message, Message::Round(_)) && post.to.is_none();
        let makes = post.iter().any(is_made);
        let kill = (makes && self.plan.trouble.kills_leaders).then_some(self.slot % 3);
        if makes && kill != Some(0) {
            self.counts.rounds += 1;
            if self.plan.keeps_log {
                self.made.push(Made {
                    parent,
                    round: round.clone(),
                });
            }
            for verdict in &verdicts {
                log(innovation(verdict));
            }
        }
        for post in &post {
            let more = match kill {
                Some(0) if is_made(post) => 1.0,
                Some(1) if is_made(post) => 0.5,
                _ => 0.0,
            };
            self.network.send(robot, post, now_ns, more);
        }
        if kill.is_some() {
            self.parties[robot] = None;
        } else if self.followed[robot] != Some(round.slot) {
            self.follow(robot, &round);
        }
    }

    fn follow(&mut self, robot: usize, round: &Round) {
        let followed = follow(&mut self.members[robot], round, robot, self.slot);
        self.followed[robot] = Some(round.slot);
        self.counts.exact += u64::from(followed.taken == Some(Taken::Exact));
        self.counts.first_order += u64::from(followed.taken == Some(Taken::FirstOrder));
        self.counts.refused += u64::from(followed.refused.is_some());
        self.counts.last_refusal = followed.refused.or(self.counts.last_refusal);
        self.counts.undone += u64::from(followed.undone);
        self.counts.joined += u64::from(followed.joins);
    }

    fn talk(&mut self, now_ns: i64, log: &mut dyn FnMut(Innovation)) {
        // Every exchange of a slot is over after a few; a message that answers another comes at once.
        for _ in 0..MOST_EXCHANGES {
            let arrived = self.network.arrived(now_ns);
            if arrived.is_empty() {
                return;
            }
            for (robot, message) in arrived {
                if self.network.is_here(self.slot, robot) {
                    self.act(robot, now_ns, log, &mut |party, post| {
                        party.hear(now_ns, &message, post)
                    });
                }
            }
        }
    }
}

const MOST_EXCHANGES: usize = 64;

fn innovation(verdict: &Verdict) -> Innovation {
    let Verdict {
        observer,
        sighting,
        outcome,
    } = verdict;
    let (sensor, robot) = if sighting.kind.is_of_two() {
        (Sensor::Neighbour, sighting.observed)
    } else {
        (Sensor::Fix, *observer)
    };
    Innovation {
        sensor,
        robot,
        accepted: outcome.accepted,
        d2: outcome.d2,
    }
}

impl Method for Crew {
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        let now_ns = self.now_ns(inputs.step);
        let motions = self.drive(inputs);
        self.fix(inputs, log);
        let shares = if inputs.step.is_multiple_of(self.every) {
            self.begin_slot(inputs, log)
        } else {
            Vec::new()
        };
        if self.plan.keeps_log {
            self.log.push(Logged {
                motions,
                fixes: inputs.fixes.clone(),
                shares,
            });
        }
        for robot in 0..self.members.len() {
            if self.network.is_here(self.slot, robot) {
                self.act(robot, now_ns, log, &mut |party, post| {
                    party.tick(now_ns, post)
                });
            }
        }
        self.talk(now_ns, log);
    }

    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        self.members[robot].estimate()
    }

    fn sent(&self) -> Option<Sent> {
        Some(self.network.sent())
    }
}
