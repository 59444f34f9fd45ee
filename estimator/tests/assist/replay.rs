//! A child that keeps what it needs for late poses: what it believed at events, and every way since.

use std::collections::BTreeMap;

use coloc_estimator::assist::fusion::Rule;
use coloc_estimator::{Belief, Fusion, GlobalPose, Motion, Propagation, RobotId, propagate};

/// Event, leader, fusion.
pub(crate) type Account = (usize, RobotId, Fusion);

pub(crate) struct Child {
    pub(crate) belief: Belief,
    pub(crate) rule: Rule,
    dt: f64,
    motions: Vec<Motion>,
    events: BTreeMap<usize, Event>,
}

struct Event {
    before: Belief,
    poses: Vec<(RobotId, GlobalPose)>,
}

impl Child {
    pub(crate) fn new(belief: Belief, rule: Rule, dt: f64) -> Self {
        Self {
            belief,
            rule,
            dt,
            motions: Vec::new(),
            events: BTreeMap::new(),
        }
    }

    pub(crate) fn drive(&mut self, motion: Motion) {
        self.belief = propagate(&self.belief, &motion, self.dt, Propagation::Paper);
        self.motions.push(motion);
    }

    /// An event is now.
    pub(crate) fn meet(&mut self) {
        let event = Event {
            before: self.belief,
            poses: Vec::new(),
        };
        self.events.insert(self.motions.len(), event);
    }

    /// Fuses poses of an event, with those that it fused before, in their places; what it did in all events since.
    pub(crate) fn fuse(&mut self, at: usize, poses: &[(RobotId, GlobalPose)]) -> Vec<Account> {
        let event = self.events.get_mut(&at).unwrap();
        event.poses.extend_from_slice(poses);
        let mut account = Vec::new();
        let mut belief = event.before;
        for step in at..=self.motions.len() {
            if step > at {
                let motion = &self.motions[step - 1];
                belief = propagate(&belief, motion, self.dt, Propagation::Paper);
            }
            if let Some(event) = self.events.get_mut(&step) {
                event.before = belief;
                belief = self.rule.fuse_all(&belief, &event.poses, |leader, fusion| {
                    account.push((step, leader, *fusion));
                });
            }
        }
        self.belief = belief;
        account
    }
}
