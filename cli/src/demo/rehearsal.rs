//! A scene without daemons: the same estimators in one process, with an ideal bus. What is promised is tried here in many worlds.

mod alone;
mod leaders;

use coloc_daemon::estimate::{settings, start};
use coloc_estimator::Pose;
use coloc_shm_types::{BeliefState, Estimate};
use coloc_sim::StepInputs;
use coloc_sim::dead_reckoning::euler_step;
use coloc_sim::method::stepwise::Stepwise;
use coloc_sim::method::{FilterSettings, Method};

use super::bars::bars;
use super::record::Record;
use super::robot_file::believed;
use super::scene::{Help, SceneName};
use super::summary::RobotSummary;
use super::wheels::WheelsAlone;
use super::world::Stage;
use crate::args::DemoArgs;
use crate::comparison::{Comparison, Moment, nees};

/// What came of every robot.
fn rehearse(stage: &Stage, seconds: f64) -> Vec<RobotSummary> {
    let robots = 0..stage.robots();
    let configs: Vec<_> = robots
        .clone()
        .map(|robot| believed(stage, robot).unwrap())
        .collect();
    let filter = FilterSettings {
        odometry: configs[0].motion.noise(),
        product: settings(&configs[0]),
        ..FilterSettings::new(stage.scenario(), stage.step_s())
    };
    let beginnings: Vec<_> = configs.iter().map(|it| start(it).belief()).collect();
    let mut team = Stepwise::new(filter, &beginnings);
    let mut heard: Vec<_> = robots.map(|_| Heard::default()).collect();
    let (sensors, mut inputs) = (stage.sensors(), StepInputs::default());
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A minute or two.
    let steps = (seconds / stage.step_s()) as usize;
    for step in 1..=steps {
        sensors.fill(step, &mut inputs);
        inputs.sightings.retain(|seen| stage.is_told_of(seen));
        team.step(&inputs, &mut |_| ());
        for (robot, heard) in heard.iter_mut().enumerate() {
            heard.hear(stage, &team, &inputs, robot);
        }
    }
    let summary = |(robot, heard): (usize, Heard)| {
        RobotSummary::of(robot, stage.parts()[robot], &heard.record, true, &[])
    };
    heard.into_iter().enumerate().map(summary).collect()
}

struct Heard {
    record: Record,
    wheels: WheelsAlone,
    driven: Pose,
    /// So many sightings of it that were told.
    words: u64,
}

impl Default for Heard {
    fn default() -> Self {
        Self {
            record: Record::new(),
            wheels: WheelsAlone::default(),
            driven: Pose::default(),
            words: 0,
        }
    }
}

impl Heard {
    fn hear(&mut self, stage: &Stage, team: &Stepwise, inputs: &StepInputs, robot: usize) {
        #[allow(clippy::cast_precision_loss)] // A minute or two.
        let time_s = inputs.step as f64 * stage.step_s();
        let velocity = inputs.odometry[robot].unwrap_or_default();
        self.driven = euler_step(&self.driven, velocity, stage.step_s());
        let estimate = Estimate {
            odometry: [self.driven.x, self.driven.y, self.driven.phi],
            ..Estimate::default()
        };
        let told = inputs.sightings.iter();
        let told = told.filter(|it| it.observed == robot && it.arrives.is_some());
        self.words += told.count() as u64;
        if inputs.step.is_multiple_of(STEPS_A_SECOND) {
            self.record.told.hear(1, time_s, self.words);
        }
        let Some(truth) = stage.truth_at(robot, time_s) else {
            return;
        };
        let (pose, covariance) = team.estimate(robot);
        let comparison = Comparison {
            time_s,
            truth,
            estimate: pose,
            sigma: [0, 1, 2].map(|i| covariance[(i, i)].sqrt()),
        };
        let moment = Moment {
            comparison,
            covariance: [(0, 0), (0, 1), (1, 1)].map(|entry| covariance[entry]),
            nees: nees(
                comparison.error(),
                &team.belief(robot).unwrap().total().to_row_major(),
            ),
            state: BeliefState::Ok,
            by_wheels: self.wheels.follow(&estimate, &truth),
        };
        self.record.hear_estimate(&estimate, Some(moment));
    }
}

/// Daemons tell their counters once a second.
const STEPS_A_SECOND: usize = 50;
const SEEDS: u64 = 15;

fn meet(robots: u16, seconds: f64, seed: u64) -> Vec<RobotSummary> {
    let args = DemoArgs {
        fleet: false,
        namespaces: false,
        loss: 0.0,
        delay_ms: 0.0,
        partition: None,
        wrong_clock: None,
        correct_offset: false,
        robots: Some(robots),
        seconds: Some(seconds),
        seed,
        scene: SceneName::Meet,
        data: None,
        laser: false,
        camera: false,
        leaders: None,
        mode: coloc_daemon::config::AssistMode::default(),
        out: None,
        json: false,
    };
    rehearse(&Stage::new(&args).unwrap(), seconds)
}

#[test]
fn what_is_promised_of_robots_that_meet_holds_in_every_world() {
    for (robots, seconds) in [
        (1, 10.0),
        (2, 10.0),
        (3, 60.0),
        (5, 10.0),
        (5, 30.0),
        (8, 30.0),
    ] {
        for seed in 1..=SEEDS {
            let broken = bars(&meet(robots, seconds, seed)).into_iter();
            let broken: Vec<_> = broken.filter(|bar| !bar.broken_by.is_empty()).collect();
            assert!(
                broken.is_empty(),
                "{robots} robots, seed {seed}: {broken:?}"
            );
        }
    }
}

/// Root of the mean squared error of the place over all worlds, of all robots with that help, beside that of their wheels alone \[m\].
fn of_all(worlds: &[Vec<RobotSummary>], help: Help) -> [f64; 2] {
    let robots = || worlds.iter().flatten().filter(|robot| robot.help == help);
    let square = |[x, y, _]: [f64; 3]| x * x + y * y;
    let rms = |of: fn(&RobotSummary) -> [f64; 3]| {
        let (sum, count) = robots().fold((0.0, 0.0), |(sum, count), robot| {
            (sum + square(of(robot)), count + 1.0)
        });
        f64::sqrt(sum / count)
    };
    [
        rms(|robot| robot.accuracy.unwrap().rms_error),
        rms(|robot| robot.wheels_alone_rms_error.unwrap()),
    ]
}

#[test]
fn help_is_worth_much_to_whoever_gets_it_and_there_is_none_for_the_untold() {
    let worlds: Vec<_> = (1..=SEEDS).map(|seed| meet(5, 30.0, seed)).collect();
    let [fixes, told, nobody] =
        [Help::Receiver, Help::Told, Help::Nobody].map(|help| of_all(&worlds, help));
    assert!(fixes[0] < 0.1 * fixes[1], "{fixes:?}");
    assert!(told[0] < 0.4 * told[1], "{told:?}");
    assert!((nobody[0] / nobody[1] - 1.0).abs() < 0.1, "{nobody:?}");
}

#[test]
fn everybody_is_seen_early_and_often() {
    let args = DemoArgs {
        fleet: false,
        namespaces: false,
        loss: 0.0,
        delay_ms: 0.0,
        partition: None,
        wrong_clock: None,
        correct_offset: false,
        robots: None,
        seconds: Some(30.0),
        seed: 1,
        scene: SceneName::Meet,
        data: None,
        laser: false,
        camera: false,
        leaders: None,
        mode: coloc_daemon::config::AssistMode::default(),
        out: None,
        json: false,
    };
    let stage = Stage::new(&args).unwrap();
    for robot in 0..stage.robots() {
        let seen: Vec<usize> = (1..=1500)
            .filter(|&step| {
                let sightings = stage.sensors().at(step).sightings;
                sightings.iter().any(|it| it.observed == robot)
            })
            .collect();
        assert!(
            seen[0] < 250,
            "robot {robot} is first seen in step {}",
            seen[0]
        );
        assert!(
            seen.len() > 100,
            "robot {robot} is seen {} times",
            seen.len()
        );
    }
}
