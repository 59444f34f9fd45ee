//! The product as a daemon runs it: one estimator with its history per robot, everything through its `step`.

use coloc_estimator::output::{Report, Verdict};
use coloc_estimator::{
    Belief, Kind, Measurement, OdometrySample, Origin, Pose, PositionFix, Sighting, SlowError,
    Stamp, TickInputs,
};
use nalgebra::Matrix3;

use super::{FilterSettings, Innovation, Method, Sensor};
use crate::fleet::{Fleet, Letter, id};
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
    robots: usize,
    fleet: Fleet,
    /// With the step at which they arrive.
    under_way: Vec<(usize, Letter)>,
}

impl Stepwise {
    /// A team that begins at `initial`.
    #[must_use]
    pub fn new(settings: FilterSettings, initial: &[Belief]) -> Self {
        let beginnings: Vec<_> = initial
            .iter()
            .map(|&belief| (Stamp::from_nanos(0), belief))
            .collect();
        Self {
            fleet: Fleet::new(settings.product, &beginnings, SLOTS),
            settings,
            robots: initial.len(),
            under_way: Vec::new(),
        }
    }

    /// The belief of `robot`, to the last bit that of a daemon with these inputs.
    #[must_use]
    pub fn belief(&self, robot: usize) -> Option<&Belief> {
        Some(&self.fleet.estimate(robot)?.belief)
    }

    /// The stamp of `step`.
    #[must_use]
    pub fn stamp(&self, step: usize) -> Stamp {
        self.settings.stamp(step)
    }

    fn measure(&mut self, robot: usize, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        let stamp = self.stamp(inputs.step);
        let start = stamp - (self.stamp(1) - Stamp::from_nanos(0));
        let motion =
            inputs.odometry[robot].map(|velocity| self.settings.odometry.nonholonomic(velocity));
        let odometry = motion.map(|motion| OdometrySample {
            source: 0,
            start,
            stamp,
            motion,
        });
        let odometry = odometry.into_iter().map(Measurement::from);
        let seen = self.sightings(robot, inputs);
        let measurements: Vec<_> = odometry
            .chain(seen)
            .chain(self.fixes(robot, inputs))
            .collect();
        let tick = TickInputs {
            stamp,
            measurements: &measurements,
        };
        let arrival = |to: usize| {
            let mut seen = inputs.sightings.iter();
            seen.find(|seen| seen.observer == robot && seen.observed == to)?
                .arrives
        };
        let under_way = &mut self.under_way;
        let mut post = |letter: Letter| {
            under_way.extend(arrival(letter.to).map(|arrives| (arrives, letter)));
        };
        self.fleet.tick(robot, &tick, &mut post, &mut |report| {
            tell(robot, report, log);
        });
    }

    fn sightings(&self, robot: usize, inputs: &StepInputs) -> impl Iterator<Item = Measurement> {
        let own = inputs
            .sightings
            .iter()
            .filter(move |seen| seen.observer == robot);
        own.map(|seen| {
            Measurement::Sighting(Sighting {
                stamp: self.stamp(inputs.step),
                origin: Origin::counted(inputs.step as u64),
                observed: id(seen.observed),
                relative: seen.relative,
                covariance: self.settings.relative,
            })
        })
    }

    fn fixes(&self, robot: usize, inputs: &StepInputs) -> impl Iterator<Item = Measurement> {
        let own = inputs.fixes.iter().filter(move |fix| fix.robot == robot);
        own.map(|fix| {
            Measurement::Fix(PositionFix {
                stamp: self.stamp(inputs.step),
                origin: Origin::counted(inputs.step as u64),
                position: fix.position,
                covariance: self.settings.fix,
                lever: [0.0; 2],
                slow: SlowError::default(),
            })
        })
    }

    fn hear(&mut self, robot: usize, now: usize, log: &mut dyn FnMut(Innovation)) {
        let arrived = self.under_way.extract_if(.., |(arrives, letter)| {
            letter.to == robot && *arrives <= now
        });
        let measurements: Vec<_> = arrived.map(|(_, letter)| letter.pose.into()).collect();
        if measurements.is_empty() {
            return;
        }
        let tick = TickInputs {
            stamp: self.stamp(now),
            measurements: &measurements,
        };
        // Nothing is sent twice: the sightings of this stamp were sent when they were taken in.
        self.fleet.tick(robot, &tick, &mut |_| (), &mut |report| {
            tell(robot, report, log);
        });
    }
}

fn tell(robot: usize, report: &Report, log: &mut dyn FnMut(Innovation)) {
    let sensor = match report.source.kind {
        Kind::Neighbour | Kind::Seen | Kind::Answer | Kind::Assist => Sensor::Neighbour,
        Kind::Fix => Sensor::Fix,
        Kind::Odometry
        | Kind::Sighting
        | Kind::Track
        | Kind::Partial
        | Kind::Ask
        | Kind::Landmark
        | Kind::Heading
        | Kind::Pose
        | Kind::Round
        | Kind::Gyro => return,
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

impl Method for Stepwise {
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        for robot in 0..self.robots {
            self.measure(robot, inputs, log);
        }
        for robot in 0..self.robots {
            self.hear(robot, inputs.step, log);
        }
    }

    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        let belief = self.belief(robot).copied().unwrap_or_default();
        (belief.pose, belief.total().matrix())
    }
}
