//! The product as a daemon runs it: one [`Estimator`] with its history per robot, everything through [`step`].

use coloc_estimator::history::Slot;
use coloc_estimator::output::{Source, Verdict};
use coloc_estimator::{
    Belief, Estimator, NeighbourPose, OdometrySample, Pose, PositionFix, RobotId, Sighting, Stamp,
    TickInputs, step,
};
use nalgebra::Matrix3;

use super::{FilterSettings, Innovation, Method, Sensor};
use crate::sensors::StepInputs;

/// History slots per robot: a second of everything, with ten robots.
const SLOTS: usize = 512;

/// A team of the product's estimators.
///
/// Every step is two ticks with the same stamp: the first takes what was measured and gives the messages, the
/// second takes the messages that arrive. Stamps are steps × dt, exactly.
#[derive(Debug)]
pub struct Stepwise {
    settings: FilterSettings,
    robots: Vec<Robot>,
    under_way: Vec<(usize, usize, NeighbourPose)>,
}

#[derive(Debug)]
struct Robot {
    estimator: Estimator<Vec<Slot>>,
    belief: Belief,
}

impl Stepwise {
    /// A team that begins at `initial`.
    #[must_use]
    pub fn new(settings: FilterSettings, initial: &[Belief]) -> Self {
        let robot = |belief: &Belief| Robot {
            estimator: Estimator::new(
                settings.product,
                Stamp::from_nanos(0),
                *belief,
                vec![Slot::default(); SLOTS],
            ),
            belief: *belief,
        };
        let robots = initial.iter().map(robot).collect();
        Self {
            settings,
            robots,
            under_way: Vec::new(),
        }
    }

    /// The belief of `robot`, to the last bit that of a daemon with these inputs.
    #[must_use]
    pub fn belief(&self, robot: usize) -> Option<&Belief> {
        self.robots.get(robot).map(|robot| &robot.belief)
    }

    /// The stamp of `step`.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // Milliseconds, whole; steps below 2^40.
    pub fn stamp(&self, step: usize) -> Stamp {
        Stamp::from_nanos(step as i64 * (self.settings.dt_s * 1e9).round() as i64)
    }

    fn measure(&mut self, robot: usize, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        let stamp = self.stamp(inputs.step);
        let start = stamp - (self.stamp(1) - Stamp::from_nanos(0));
        let motion =
            inputs.odometry[robot].map(|velocity| self.settings.odometry.nonholonomic(velocity));
        let odometry = motion.map(|motion| OdometrySample {
            start,
            stamp,
            motion,
        });
        let sightings: Vec<Sighting> = self.sightings(robot, inputs);
        let fixes: Vec<PositionFix> = self.fixes(robot, inputs);
        let tick = TickInputs {
            stamp,
            odometry: odometry.as_slice(),
            sightings: &sightings,
            neighbours: &[],
            fixes: &fixes,
        };
        let under_way = &mut self.under_way;
        let arrival = |to: usize| {
            inputs
                .sightings
                .iter()
                .find(|s| s.observer == robot && s.observed == to)
        };
        let outputs = step(&mut self.robots[robot].estimator, &tick);
        for message in outputs.outgoing {
            let to = usize::from(message.to.0);
            if let Some(arrives) = arrival(to).and_then(|seen| seen.arrives) {
                let neighbour = NeighbourPose {
                    stamp: message.stamp,
                    sequence: inputs.step as u64,
                    sender: id(robot),
                    pose: message.pose,
                    total: message.total,
                    independent: message.independent,
                };
                under_way.push((arrives, to, neighbour));
            }
        }
        report(robot, outputs.reports, log);
        self.robots[robot].belief = outputs.estimate.belief;
    }

    fn sightings(&self, robot: usize, inputs: &StepInputs) -> Vec<Sighting> {
        let own = inputs
            .sightings
            .iter()
            .filter(|seen| seen.observer == robot);
        let sighting = |seen: &crate::sensors::Sighting| Sighting {
            stamp: self.stamp(inputs.step),
            sequence: inputs.step as u64,
            observed: id(seen.observed),
            relative: seen.relative,
            covariance: self.settings.relative,
        };
        own.map(sighting).collect()
    }

    fn fixes(&self, robot: usize, inputs: &StepInputs) -> Vec<PositionFix> {
        let own = inputs.fixes.iter().filter(|fix| fix.robot == robot);
        let fix = |fix: &crate::sensors::Fix| PositionFix {
            stamp: self.stamp(inputs.step),
            sequence: inputs.step as u64,
            position: fix.position,
            covariance: self.settings.fix,
        };
        own.map(fix).collect()
    }

    fn hear(&mut self, robot: usize, now: usize, log: &mut dyn FnMut(Innovation)) {
        let arrived = self
            .under_way
            .extract_if(.., |(arrives, to, _)| *to == robot && *arrives <= now);
        let neighbours: Vec<NeighbourPose> = arrived.map(|(_, _, message)| message).collect();
        if neighbours.is_empty() {
            return;
        }
        let tick = TickInputs {
            stamp: self.stamp(now),
            neighbours: &neighbours,
            ..TickInputs::default()
        };
        let outputs = step(&mut self.robots[robot].estimator, &tick);
        report(robot, outputs.reports, log);
        self.robots[robot].belief = outputs.estimate.belief;
    }
}

fn report(
    robot: usize,
    reports: &[coloc_estimator::output::Report],
    log: &mut dyn FnMut(Innovation),
) {
    for report in reports {
        let sensor = match report.source {
            Source::Neighbour(_) => Sensor::Neighbour,
            Source::Fix => Sensor::Fix,
            Source::Odometry | Source::Sighting(_) => continue,
        };
        let (accepted, d2) = match report.verdict {
            Verdict::Accepted { d2 } => (true, d2),
            Verdict::Gated { d2 } => (false, d2),
            _ => (false, f64::INFINITY),
        };
        log(Innovation {
            sensor,
            robot,
            accepted,
            d2,
        });
    }
}

#[allow(clippy::cast_possible_truncation)] // A team is far below 2^16 robots.
fn id(robot: usize) -> RobotId {
    RobotId(robot as u16)
}

impl Method for Stepwise {
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        for robot in 0..self.robots.len() {
            self.measure(robot, inputs, log);
        }
        for robot in 0..self.robots.len() {
            self.hear(robot, inputs.step, log);
        }
    }

    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        let belief = &self.robots[robot].belief;
        (belief.pose, *belief.total.matrix())
    }
}
