//! Algorithm 4 for a whole team in one process, in its own order, on the product's own functions.

use std::collections::VecDeque;

use coloc_estimator::convert::{GlobalPose, tell};
use coloc_estimator::{Belief, Motion, Pace, Pose, Stamp, fix};
use nalgebra::Matrix3;

use super::rule::Rule;
use super::wheels::Wheels;
use super::{FilterSettings, Innovation, Method, Sensor};
use crate::sensors::StepInputs;

/// A team whose robots fuse by one [`Rule`].
#[derive(Clone, Debug)]
pub struct Team {
    rule: Rule,
    settings: FilterSettings,
    robots: Vec<Robot>,
    /// Messages on their way, in the order of their sending.
    under_way: Vec<Message>,
}

#[derive(Clone, Debug)]
struct Robot {
    belief: Belief,
    /// Of the messages received.
    pace: Pace,
    wheels: Wheels,
    now: Event,
    /// The last events, the latest last, with the belief and the pace before each: where late messages are put.
    past: VecDeque<(Belief, Pace, Event)>,
}

/// All that happens to one robot at one step.
#[derive(Clone, Debug)]
struct Event {
    step: usize,
    motion: Motion,
    sent: bool,
    /// Ascending in sender.
    received: Vec<(usize, GlobalPose)>,
    fix: Option<[f64; 2]>,
}

#[derive(Clone, Debug)]
struct Message {
    arrives: usize,
    step: usize,
    sender: usize,
    receiver: usize,
    pose: GlobalPose,
}

impl Event {
    fn new(step: usize, motion: Motion) -> Self {
        Self {
            step,
            motion,
            sent: false,
            received: Vec::new(),
            fix: None,
        }
    }
}

impl Team {
    /// A team that begins at `initial`.
    #[must_use]
    pub fn new(rule: Rule, settings: FilterSettings, initial: &[Belief]) -> Self {
        let robot = |belief: &Belief| Robot {
            belief: rule.books(belief),
            pace: Pace::beginning(Stamp::from_nanos(0)),
            wheels: Wheels::default(),
            now: Event::new(0, Motion::standstill([0.0; 3])),
            past: VecDeque::new(),
        };
        Self {
            rule,
            settings,
            robots: initial.iter().map(robot).collect(),
            under_way: Vec::new(),
        }
    }

    /// The belief of `robot`; of interest beyond pose and P is its independent part.
    #[must_use]
    pub fn belief(&self, robot: usize) -> Option<&Belief> {
        self.robots.get(robot).map(|robot| &robot.belief)
    }

    fn begin(&mut self, inputs: &StepInputs) {
        for (robot, reported) in self.robots.iter_mut().zip(&inputs.odometry) {
            let motion = robot.wheels.motion(*reported, &self.settings);
            robot.begin(inputs.step, motion, &self.settings);
        }
    }

    fn send(&mut self, inputs: &StepInputs) {
        for seen in &inputs.sightings {
            let observer = &mut self.robots[seen.observer];
            observer.now.sent = true;
            let Some(arrives) = seen.arrives else {
                continue;
            };
            let pose = tell(
                &observer.belief,
                &seen.relative,
                &self.settings.relative,
                &self.settings.product,
            );
            let (step, sender, receiver) = (inputs.step, seen.observer, seen.observed);
            self.under_way.push(Message {
                arrives,
                step,
                sender,
                receiver,
                pose,
            });
        }
    }

    /// Delivers what arrives at `step`: messages of this very step to be fused, late ones into the past.
    fn deliver(&mut self, step: usize, late: bool) {
        for message in self.under_way.extract_if(.., |message| {
            message.arrives <= step && late == (message.step < step)
        }) {
            let robot = &mut self.robots[message.receiver];
            if late {
                robot.receive_late(&message, self.rule, &self.settings);
            } else {
                robot.now.receive(message.sender, message.pose);
            }
        }
    }
}

impl Event {
    /// Empties the event for another step; its storage is used again.
    fn begin(&mut self, step: usize, motion: Motion) {
        (self.step, self.motion, self.sent, self.fix) = (step, motion, false, None);
        self.received.clear();
    }

    fn receive(&mut self, sender: usize, pose: GlobalPose) {
        let place = self.received.partition_point(|(other, _)| *other <= sender);
        self.received.insert(place, (sender, pose));
    }

    /// What comes after the propagation: fuse, reset, fix.
    fn finish(
        &self,
        mut belief: Belief,
        pace: &mut Pace,
        rule: Rule,
        settings: &FilterSettings,
        log: &mut dyn FnMut(Sensor, bool, f64),
    ) -> Belief {
        for (_, pose) in &self.received {
            *pace = pace.heard(settings.stamp(self.step));
            let fusion = rule.fuse(&belief, pose, pace);
            log(Sensor::Neighbour, fusion.accepted, fusion.d2);
            belief = fusion.belief;
        }
        if rule.makes_dependent(!self.received.is_empty(), self.sent) {
            belief.make_dependent();
            *pace = pace.met();
        }
        if let Some(position) = self.fix {
            let update = fix::update(
                &belief,
                position,
                &settings.fix,
                settings.product.position_gate,
            );
            log(Sensor::Fix, update.accepted, update.d2);
            belief = update.belief;
        }
        rule.books(&belief)
    }
}

impl Robot {
    fn begin(&mut self, step: usize, motion: Motion, settings: &FilterSettings) {
        self.now.begin(step, motion);
        if settings.longest_delay > 0 {
            self.past
                .push_back((self.belief, self.pace, self.now.clone()));
            if self.past.len() > settings.longest_delay + 1 {
                self.past.pop_front();
            }
        }
        self.belief = settings.propagated(&self.belief, &motion);
    }

    /// Puts a message into the event of its step and goes through everything since again.
    fn receive_late(&mut self, message: &Message, rule: Rule, settings: &FilterSettings) {
        let Some(index) = self
            .past
            .iter()
            .position(|(_, _, event)| event.step == message.step)
        else {
            return;
        };
        self.past[index].2.receive(message.sender, message.pose);
        let mut belief = self.past[index].0;
        let mut pace = self.past[index].1;
        for (before, paced, event) in self.past.range_mut(index..) {
            *before = belief;
            *paced = pace;
            belief = event.finish(
                settings.propagated(&belief, &event.motion),
                &mut pace,
                rule,
                settings,
                &mut |_, _, _| (),
            );
        }
        self.belief = belief;
        self.pace = pace;
    }
}

impl Method for Team {
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        self.begin(inputs);
        if self.rule.talks() {
            self.send(inputs);
            self.deliver(inputs.step, false);
        }
        for fix in &inputs.fixes {
            self.robots[fix.robot].now.fix = Some(fix.position);
        }
        for (index, robot) in self.robots.iter_mut().enumerate() {
            let mut log = |sensor, accepted, d2| {
                log(Innovation {
                    sensor,
                    robot: index,
                    accepted,
                    d2,
                });
            };
            robot.belief = robot.now.finish(
                robot.belief,
                &mut robot.pace,
                self.rule,
                &self.settings,
                &mut log,
            );
            if let Some((_, _, last)) = robot.past.back_mut() {
                last.clone_from(&robot.now);
            }
        }
        self.deliver(inputs.step, true);
    }

    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        let belief = &self.robots[robot].belief;
        (belief.pose, belief.total().matrix())
    }
}
