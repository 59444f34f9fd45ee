//! One run of one method.

use std::time::{Duration, Instant};

use crate::evaluate::config::EvalConfig;
use crate::method::{self, FilterSettings, Innovation, Kind, Sensor, Sent};
use crate::metrics::{NisTotals, Sample, Samples, Totals};
use crate::random::Noise;
use crate::sensors::{Sensors, StepInputs};
use crate::world::World;

/// How many steps are taken between two words about the progress.
const STEPS_PER_REPORT: usize = 2500;

/// What a run came to.
#[derive(Clone, Debug)]
pub(super) struct Outcome {
    pub(super) robots: Vec<RobotOutcome>,
    /// What was sent.
    pub(super) sent: Sent,
    /// Spent in the estimators alone.
    pub(super) time: Duration,
}

/// What a run came to for one robot.
#[derive(Clone, Debug, Default)]
pub(super) struct RobotOutcome {
    pub(super) samples: Samples,
    pub(super) totals: Totals,
    pub(super) neighbours: NisTotals,
    pub(super) fixes: NisTotals,
}

pub(super) fn run(config: &EvalConfig, kind: Kind, run: u16, advance: &dyn Fn(u64)) -> Outcome {
    let world = config.world(run);
    let sensors = Sensors::new(&*world, &config.scenario, config.seed, run);
    let settings = FilterSettings {
        noise: Noise::new(config.seed, run),
        ..config.filters(world.dt_s())
    };
    let mut team = method::build(kind, &settings, &config.beginning(&*world));
    let steps = config.steps();
    let robot = RobotOutcome {
        samples: Vec::with_capacity(steps),
        ..RobotOutcome::default()
    };
    let mut outcome = Outcome {
        robots: vec![robot; world.robots()],
        sent: Sent::default(),
        time: Duration::ZERO,
    };
    outcome.observe(&*world, 0, &*team);
    let mut inputs = StepInputs::default();
    for step in 1..steps {
        sensors.fill(step, &mut inputs);
        outcome.sent.messages += inputs.sightings.len() as u64;
        let before = Instant::now();
        team.step(&inputs, &mut |innovation| {
            outcome_log(&mut outcome.robots, innovation);
        });
        outcome.time += before.elapsed();
        outcome.observe(&*world, step, &*team);
        if step.is_multiple_of(STEPS_PER_REPORT) {
            advance((STEPS_PER_REPORT * world.robots()) as u64);
        }
    }
    let each = kind.message_bytes() as u64;
    outcome.sent.bytes = each * outcome.sent.messages;
    if each == 0 {
        outcome.sent.messages = 0;
    }
    outcome.sent = team.sent().unwrap_or(outcome.sent);
    advance(((steps - (steps - 1) / STEPS_PER_REPORT * STEPS_PER_REPORT) * world.robots()) as u64);
    outcome
}

fn outcome_log(robots: &mut [RobotOutcome], innovation: Innovation) {
    let Some(robot) = robots.get_mut(innovation.robot) else {
        return;
    };
    let totals = match innovation.sensor {
        Sensor::Neighbour => &mut robot.neighbours,
        Sensor::Fix => &mut robot.fixes,
    };
    totals.add(innovation.accepted, innovation.d2);
}

impl Outcome {
    fn observe(&mut self, world: &dyn World, step: usize, team: &dyn method::Method) {
        for (robot, outcome) in self.robots.iter_mut().enumerate() {
            let sample = world.truth(step, robot).map(|truth| {
                let (pose, covariance) = team.estimate(robot);
                Sample::new(&pose, &covariance, &truth)
            });
            if let Some(sample) = &sample {
                outcome.totals.add(sample);
            }
            outcome.samples.push(sample);
        }
    }
}
