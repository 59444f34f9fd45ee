//! A team that makes rounds as it flies: the product's `step` with its history, and the [`Seat`] of `coloc-rounds`, robot by robot.
//!
//! What the daemons and their programs do over shared memory, in one process: a slot is shared in the tick in which the wheels have reached it, or
//! a tick later, and what `coloc-rounds` has its robot do comes with the tick after that. Robots begin apart and join.

use coloc_estimator::rounds::{AtSlot, RoundSettings, Sharing};
use coloc_estimator::{
    Belief, Covariance3, Deed, Estimate, Estimator, Kind, Measurement, OdometrySample, Origin,
    Pose, PositionFix, RoundWord, Settings, Slot, SlowError, Stamp, TickInputs, Verdict, step,
};
use coloc_rounds::seat::{Deed as Asked, Seat, Seen, Told, Word};
use coloc_rounds::{Going, Message, Post, Rules};
use nalgebra::Matrix3;

use super::Plan;
use super::network::Network;
use crate::method::{FilterSettings, Innovation, Method, Sensor, Sent};
use crate::sensors::StepInputs;

/// History slots per robot: a second of everything.
const SLOTS: usize = 512;

/// A sighting is of use at a slot from which it is no farther: the daemon's default \[ns\].
const SKEW_NS: i64 = 50_000_000;

/// After so many slots a robot whose last round nobody knows joins anew, as in `coloc-rounds`.
const PATIENCE: u32 = 4;

/// Every exchange of a slot is over after a few.
const MOST_EXCHANGES: usize = 64;

/// How often what happened.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Rounds that were made.
    pub rounds: u64,
    /// Corrections that robots were told.
    pub corrections: u64,
    /// Those of them that came after the history.
    pub late: u64,
    /// Words of rounds that robots refused, late corrections among them.
    pub refused: u64,
    /// Rounds that were taken back.
    pub undone: u64,
    /// Robots that joined.
    pub joined: u64,
}

#[derive(Debug)]
struct Pilot {
    estimator: Estimator<Vec<Slot>>,
    /// `None`: its process was killed in this slot.
    seat: Option<Seat>,
    estimate: Estimate,
    /// The last slot that it shared.
    slot: u64,
    /// For its next tick.
    words: Vec<Measurement>,
    /// Of what is said to it.
    sequence: u64,
}

/// The team.
#[derive(Debug)]
pub struct Flight {
    settings: FilterSettings,
    plan: Plan,
    rules: Rules,
    /// Steps from slot to slot.
    every: usize,
    pilots: Vec<Pilot>,
    network: Network,
    slot: u64,
    tally: Tally,
}

impl Flight {
    /// A team that begins at `initial`. Of the plan the history is that of [`Settings::history`], and fixes are silent.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A few steps.
    pub fn new(settings: FilterSettings, initial: &[Belief], plan: Plan) -> Self {
        let robots = initial.len();
        let [hello_ns, deadline_ns] = plan.wait_s.map(|it| (it * 1e9) as i64);
        let product = Settings {
            rounds: Some(RoundSettings {
                robots,
                gate: plan.correction_gate,
            }),
            ..settings.product
        };
        let rules = Rules {
            robots,
            hello_ns,
            deadline_ns,
            patience: PATIENCE,
            gates: [
                coloc_estimator::gate::CHI2_1_99,
                product.position_gate,
                product.fusion.gate,
            ],
        };
        let begin = Stamp::from_nanos(0);
        let pilot = |(robot, belief): (usize, &Belief)| Pilot {
            estimator: Estimator::new(product, begin, *belief, vec![Slot::default(); SLOTS]),
            seat: Some(Seat::new(robot, rules, SKEW_NS)),
            estimate: Estimate {
                belief: *belief,
                ..Estimate::default()
            },
            slot: 0,
            words: Vec::new(),
            sequence: 0,
        };
        Self {
            every: ((1.0 / plan.rate_hz / settings.dt_s).round() as usize).max(1),
            pilots: initial.iter().enumerate().map(pilot).collect(),
            network: Network::new(robots, settings.radio, plan.trouble, settings.noise.clone()),
            slot: 0,
            tally: Tally::default(),
            settings,
            plan,
            rules,
        }
    }

    /// How often what happened.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// What the robot senses in this step, and what its `coloc-rounds` said.
    fn measured(&mut self, robot: usize, inputs: &StepInputs) -> Vec<Measurement> {
        let stamp = self.settings.stamp(inputs.step);
        let start = self.settings.stamp(inputs.step.saturating_sub(1));
        let mut measured = std::mem::take(&mut self.pilots[robot].words);
        measured.extend(inputs.odometry[robot].map(|velocity| {
            Measurement::Odometry(OdometrySample {
                source: 0,
                start,
                stamp,
                motion: self.settings.odometry.nonholonomic(velocity),
            })
        }));
        let own = inputs.fixes.iter().filter(|fix| fix.robot == robot);
        measured.extend(own.map(|fix| {
            Measurement::Fix(PositionFix {
                stamp,
                origin: Origin::counted(inputs.step as u64),
                position: fix.position,
                covariance: self.settings.fix,
                lever: [0.0; 2],
                slow: SlowError::default(),
            })
        }));
        if let Some(slot) = self.begun(robot, inputs) {
            measured.push(Measurement::Round(RoundWord {
                stamp: self.slot_stamp(slot),
                origin: Origin::default(),
                deed: Deed::Share(slot),
                of: None,
            }));
        }
        measured
    }

    /// The slot to be shared now: one that the wheels have reached, or a tick later whatever they say.
    fn begun(&mut self, robot: usize, inputs: &StepInputs) -> Option<u64> {
        let begun = inputs.step / self.every;
        let is_settled =
            inputs.odometry[robot].is_some() || !inputs.step.is_multiple_of(self.every);
        let slot = begun.saturating_sub(usize::from(!is_settled)) as u64;
        let last = &mut self.pilots[robot].slot;
        let is_new = slot > *last;
        *last = slot.max(*last);
        is_new.then_some(slot)
    }

    #[allow(clippy::cast_possible_truncation)] // Steps.
    fn slot_stamp(&self, slot: u64) -> Stamp {
        self.settings.stamp(slot as usize * self.every)
    }

    fn tick(
        &mut self,
        robot: usize,
        inputs: &StepInputs,
        log: &mut dyn FnMut(Innovation),
    ) -> Option<AtSlot> {
        let measurements = self.measured(robot, inputs);
        let stamp = self.settings.stamp(inputs.step);
        let tick = TickInputs {
            stamp,
            measurements: &measurements,
        };
        let pilot = &mut self.pilots[robot];
        let begins = stamp - pilot.estimator.settings().history;
        let outputs = step(&mut pilot.estimator, &tick);
        for report in outputs.reports {
            let (accepted, d2) = match report.verdict {
                Verdict::Accepted { d2 } => (true, d2),
                Verdict::Gated { d2 } => (false, d2),
                _ => (false, f64::INFINITY),
            };
            if report.source.kind == Kind::Fix {
                log(Innovation {
                    sensor: Sensor::Fix,
                    robot,
                    accepted,
                    d2,
                });
            }
        }
        let words = measurements.iter().filter_map(|it| match it {
            Measurement::Round(word) => Some(word.deed),
            _ => None,
        });
        let refused = outputs
            .reports
            .iter()
            .filter(|it| it.source.kind == Kind::Round && it.verdict != Verdict::Heard);
        self.tally.refused += refused.count() as u64;
        pilot.estimate = outputs.estimate;
        let shared = outputs.shared;
        for deed in words {
            match deed {
                Deed::Correct { slot, .. } => {
                    self.tally.corrections += 1;
                    self.tally.late += u64::from(self.slot_stamp(slot) < begins);
                }
                Deed::Undo(_) => self.tally.undone += 1,
                Deed::Join => self.tally.joined += 1,
                Deed::Share(_) | Deed::Leave => {}
            }
        }
        shared
    }

    fn see(&mut self, inputs: &StepInputs) {
        let (stamp, noise) = (
            self.settings.stamp(inputs.step),
            self.settings.relative.matrix(),
        );
        for seen in &inputs.sightings {
            if let Some(seat) = &mut self.pilots[seen.observer].seat {
                seat.see(Seen {
                    stamp_ns: stamp.as_nanos(),
                    observed: seen.observed,
                    pose: seen.relative,
                    noise,
                });
            }
        }
    }

    /// Sends what a robot's `coloc-rounds` says to others, and keeps what it says to the robot for the next tick.
    fn say(&mut self, robot: usize, now_ns: i64, words: Vec<Word>) {
        let posts = words.iter().filter_map(|it| match it {
            Word::Post(post) => Some(post),
            Word::Deed(_) => None,
        });
        let posts: Vec<Post> = posts.cloned().collect();
        let is_made = |post: &Post| matches!(post.message, Message::Round(_)) && post.to.is_none();
        let makes = posts.iter().any(is_made);
        let kill = (makes && self.plan.trouble.kills_leaders).then_some(self.slot % 3);
        self.tally.rounds += u64::from(makes && kill != Some(0));
        for post in &posts {
            let more = match kill {
                Some(0) if is_made(post) => 1.0,
                Some(1) if is_made(post) => 0.5,
                _ => 0.0,
            };
            self.network.send(robot, post, now_ns, more);
        }
        if kill.is_some() {
            self.pilots[robot].seat = None;
            return;
        }
        for word in words {
            if let Word::Deed(deed) = word {
                let pilot = &mut self.pilots[robot];
                pilot.sequence += 1;
                pilot.words.extend(asked(&deed, now_ns, pilot.sequence));
            }
        }
    }

    fn told(&self, robot: usize, at: &AtSlot) -> (Told, Going) {
        let estimate = &self.pilots[robot].estimate;
        let period_s = self.settings.product.odometry.reference_period.as_seconds();
        let going = Going {
            velocity: estimate.velocity,
            noise: estimate.velocity_covariance.matrix() * period_s,
        };
        let told = match at.sharing {
            Sharing::Apart => Told::Apart,
            Sharing::Nowhere => Told::Nowhere,
            Sharing::Belief(shared) => Told::Belief(shared),
        };
        (told, going)
    }

    /// A robot that forgets what it shares.
    #[allow(clippy::cast_precision_loss)] // Hours in nanoseconds.
    fn forgets(&self, robot: usize, now_ns: i64) -> bool {
        let dt_ns = self.settings.dt_s * 1e9;
        self.plan.trouble.restart.is_some_and(|(who, at_s)| {
            who == robot && (0.0..dt_ns).contains(&(now_ns as f64 - at_s * 1e9))
        })
    }

    fn talk(&mut self, now_ns: i64) {
        for _ in 0..MOST_EXCHANGES {
            let arrived = self.network.arrived(now_ns);
            if arrived.is_empty() {
                return;
            }
            for (robot, message) in arrived {
                if !self.network.is_here(self.slot, robot) {
                    continue;
                }
                if let Some(seat) = &mut self.pilots[robot].seat {
                    let words = seat.hear(now_ns, &message);
                    self.say(robot, now_ns, words);
                }
            }
        }
    }
}

/// As the estimator takes it; `None` if it is no belief.
fn asked(deed: &Asked, now_ns: i64, sequence: u64) -> Option<Measurement> {
    let deed = match deed {
        Asked::Correct(told) => Deed::Correct {
            slot: told.slot,
            pose: told.pose,
            covariance: Covariance3::new(told.covariance).ok()?,
            factor: told.factor,
        },
        Asked::Undo(last) => Deed::Undo(*last),
        Asked::Join => Deed::Join,
        Asked::Leave => Deed::Leave,
    };
    Some(Measurement::Round(RoundWord {
        stamp: Stamp::from_nanos(now_ns),
        origin: Origin::counted(sequence),
        deed,
        of: None,
    }))
}

impl Method for Flight {
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        let now_ns = self.settings.stamp(inputs.step).as_nanos();
        self.see(inputs);
        for robot in 0..self.pilots.len() {
            if self.forgets(robot, now_ns) {
                self.pilots[robot]
                    .words
                    .extend(asked(&Asked::Join, now_ns, u64::MAX));
            }
            let Some(at) = self.tick(robot, inputs, log) else {
                continue;
            };
            self.slot = at.slot;
            let (told, going) = self.told(robot, &at);
            let rules = self.rules;
            // Who was killed is back at the next slot.
            let seat = self.pilots[robot]
                .seat
                .get_or_insert_with(|| Seat::new(robot, rules, SKEW_NS));
            if self.network.is_here(at.slot, robot) {
                seat.go(going);
                let words = seat.share(now_ns, (at.slot, at.stamp.as_nanos()), &told);
                self.say(robot, now_ns, words);
            }
        }
        for robot in 0..self.pilots.len() {
            if self.network.is_here(self.slot, robot)
                && let Some(seat) = &mut self.pilots[robot].seat
            {
                let words = seat.tick(now_ns);
                self.say(robot, now_ns, words);
            }
        }
        self.talk(now_ns);
    }

    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        let belief = &self.pilots[robot].estimate.belief;
        (belief.pose, belief.total().matrix())
    }

    fn sent(&self) -> Option<Sent> {
        Some(self.network.sent())
    }
}
