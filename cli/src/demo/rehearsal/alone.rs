//! The scene `lost`: everybody for itself, through the estimator as a daemon sets it up.

use coloc_daemon::config::Config;
use coloc_daemon::estimate::{Estimate, start};
use coloc_estimator::{
    Covariance2, Estimate as Estimated, Finding, FindingState, Kind, Measurement, OdometrySample,
    Origin, PositionFix, SlowError, Stamp, TickInputs,
};
use coloc_shm_types::{BeliefState, Input};
use coloc_sim::StepInputs;

use super::super::record::Record;
use super::super::robot_file::believed;
use super::super::scene::SceneName;
use super::super::summary::RobotSummary;
use super::super::tale::Tale;
use super::super::world::{Received, Stage};
use crate::args::DemoArgs;
use crate::comparison::{Comparison, Moment, nees};

struct Robot {
    config: Config,
    estimator: Estimate,
    record: Record,
}

impl Robot {
    fn new(stage: &Stage, robot: usize) -> Self {
        let config = believed(stage, robot).unwrap();
        Self {
            estimator: Estimate::new(&config, Stamp::default(), &start(&config)),
            config,
            record: Record::new(),
        }
    }

    fn tick(&mut self, stage: &Stage, robot: usize, inputs: &StepInputs, received: &[Received]) {
        let stamp = stamp(stage, inputs.step);
        let velocity = inputs.odometry[robot].unwrap_or_default();
        let wheels = OdometrySample {
            source: 0,
            start: self::stamp(stage, inputs.step - 1),
            stamp,
            motion: self.config.motion.noise().nonholonomic(velocity),
        };
        let own = received.iter().filter(|it| it.robot == robot);
        let fixes = own.map(|it| fix(stage, it, stamp, inputs.step));
        let measurements: Vec<Measurement> = [wheels.into()].into_iter().chain(fixes).collect();
        let outputs = self.estimator.step(&TickInputs {
            stamp,
            measurements: &measurements,
        });
        let time_s = (stamp - Stamp::default()).as_seconds();
        let moment = moment(stage, robot, time_s, &outputs.estimate, outputs.finding);
        for dissent in outputs.finding.dissents() {
            let who = (Input::Position, dissent.source.number);
            assert_eq!(dissent.source.kind, Kind::Fix);
            self.record.hear_against(who, time_s);
        }
        self.record.moments.push(moment);
    }
}

pub(super) fn stamp(stage: &Stage, step: usize) -> Stamp {
    Stamp::from_nanos(i64::try_from(step).unwrap() * stage.step_ns())
}

pub(super) fn fix(stage: &Stage, received: &Received, stamp: Stamp, step: usize) -> Measurement {
    let variance = stage.scenario().fixes.sigma_m.powi(2);
    Measurement::Fix(PositionFix {
        stamp,
        origin: Origin {
            source: received.receiver,
            ..Origin::counted(step as u64)
        },
        position: received.position,
        covariance: Covariance2::diagonal([variance; 2]).unwrap(),
        lever: [0.0; 2],
        slow: SlowError::default(),
    })
}

pub(super) fn moment(
    stage: &Stage,
    robot: usize,
    time_s: f64,
    estimate: &Estimated,
    finding: &Finding,
) -> Moment {
    let total = estimate.belief.total().to_row_major();
    let comparison = Comparison {
        time_s,
        truth: stage.truth_at(robot, time_s).unwrap(),
        estimate: estimate.belief.pose,
        sigma: [0, 4, 8].map(|diagonal| total[diagonal].sqrt()),
    };
    Moment {
        comparison,
        covariance: [0, 1, 4].map(|entry| total[entry]),
        nees: nees(comparison.error(), &total),
        state: match finding.state {
            FindingState::Ok => BeliefState::Ok,
            FindingState::Finding => BeliefState::Finding,
            FindingState::Contradicted => BeliefState::Contradicted,
            FindingState::Lost => BeliefState::Lost,
        },
        by_wheels: comparison.truth,
    }
}

fn stage(seed: u64) -> Stage {
    let args = DemoArgs {
        fleet: false,
        namespaces: false,
        loss: 0.0,
        delay_ms: 0.0,
        partition: None,
        robots: None,
        seconds: None,
        seed,
        scene: SceneName::Lost,
        data: None,
        laser: false,
        camera: false,
        leaders: None,
        mode: coloc_daemon::config::AssistMode::default(),
        out: None,
        json: false,
    };
    Stage::new(&args).unwrap()
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A minute or two.
fn play(stage: &Stage) -> Vec<Record> {
    let mut robots: Vec<_> = (0..stage.robots())
        .map(|it| Robot::new(stage, it))
        .collect();
    let (sensors, mut inputs) = (stage.sensors(), StepInputs::default());
    let mut received = Vec::new();
    let steps = (SceneName::Lost.length_s() / stage.step_s()) as usize;
    for step in 1..=steps {
        sensors.fill(step, &mut inputs);
        stage.received(&inputs, &mut received);
        for (index, robot) in robots.iter_mut().enumerate() {
            robot.tick(stage, index, &inputs, &received);
        }
    }
    robots.into_iter().map(|robot| robot.record).collect()
}

const SEEDS: u64 = 25;

#[test]
fn what_is_promised_of_lost_robots_holds_in_every_world() {
    for seed in 1..=SEEDS {
        let stage = stage(seed);
        let summary = |(robot, record): (usize, &Record)| {
            RobotSummary::of(robot, stage.parts()[robot], record, true, &[])
        };
        let robots: Vec<_> = play(&stage).iter().enumerate().map(summary).collect();
        let trials = robots.iter().flat_map(|robot| &robot.trials);
        assert_eq!(trials.clone().count(), 11, "all are due");
        let broken: Vec<_> = trials.filter(|trial| !trial.kept).collect();
        assert!(broken.is_empty(), "seed {seed}: {broken:?}");
    }
}

/// No tale's promises are kept by what happened in another.
#[test]
fn each_promise_can_be_broken() {
    let records = play(&stage(1));
    let tales = [Tale::Nowhere, Tale::Carried, Tale::Liar, Tale::Doubted];
    let kept = |tale: Tale, record: &Record| tale.trials(record).iter().all(|it| it.kept);
    for (tale, record) in tales.into_iter().zip(&records) {
        assert!(kept(tale, record));
        for other in tales.into_iter().filter(|&it| it != tale) {
            assert!(!kept(other, record), "{tale:?} passes for {other:?}");
        }
    }
    let mut wrong = Record::new();
    wrong.moments.clone_from(&records[2].moments);
    wrong.against.clone_from(&records[2].against);
    wrong.moments[1900].nees = 31.0;
    assert!(!kept(Tale::Liar, &wrong));
}
