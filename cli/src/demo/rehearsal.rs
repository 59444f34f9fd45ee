//! A scene without daemons: the same estimators in one process, with an ideal bus. What is promised is tried here in many worlds.

use coloc_daemon::estimate::{initial, settings};
use coloc_estimator::Pose;
use coloc_shm_types::Estimate;
use coloc_sim::StepInputs;
use coloc_sim::dead_reckoning::euler_step;
use coloc_sim::method::stepwise::Stepwise;
use coloc_sim::method::{FilterSettings, Method};

use super::record::Record;
use super::robot_file::believed;
use super::summary::RobotSummary;
use super::wheels::WheelsAlone;
use super::world::Stage;
use crate::comparison::{Comparison, Moment};

/// What is heard of every robot.
pub(super) fn rehearse(stage: &Stage, seconds: f64) -> Vec<RobotSummary> {
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
    let beginnings: Vec<_> = configs.iter().map(initial).collect();
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
}

impl Default for Heard {
    fn default() -> Self {
        Self {
            record: Record::new(),
            wheels: WheelsAlone::default(),
            driven: Pose::default(),
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
            by_wheels: self.wheels.follow(&estimate, &truth),
        };
        self.record.hear_estimate(&estimate, Some(moment));
    }
}

#[test]
fn sweep() {
    use super::scene::SceneName;
    use crate::args::DemoArgs;
    let n: u64 = std::env::var("SEEDS").map_or(20, |it| it.parse().unwrap());
    for robots in [1u16, 2, 3, 4, 5, 8, 16, 32] {
        if std::env::var("ROBOTS").is_ok_and(|it| it != robots.to_string()) {
            continue;
        }
        for seconds in [3.0, 6.0, 10.0, 30.0, 120.0] {
            let mut all: std::collections::BTreeMap<&str, Vec<([f64; 3], f64, f64, f64)>> =
                Default::default();
            for seed in 1..=n {
                let args = DemoArgs {
                    robots: Some(robots),
                    seconds,
                    seed,
                    scene: SceneName::Meet,
                    data: None,
                    out: None,
                    json: false,
                };
                let stage = Stage::new(&args).unwrap();
                for (robot, summary) in rehearse(&stage, seconds).iter().enumerate() {
                    let accuracy = summary.accuracy.unwrap();
                    let wheels = summary.wheels_alone_rms_error.unwrap();
                    all.entry(stage.parts()[robot].help.words())
                        .or_default()
                        .push((
                            accuracy.mean_abs_error,
                            accuracy.inside_3_sigma.into_iter().fold(1.0, f64::min),
                            accuracy.rms_place(),
                            wheels[0].hypot(wheels[1]),
                        ));
                }
            }
            for (help, rows) in all {
                let worst = rows.iter().fold([0.0f64; 3], |w, r| {
                    [w[0].max(r.0[0]), w[1].max(r.0[1]), w[2].max(r.0[2])]
                });
                let mut inside: Vec<f64> = rows.iter().map(|r| r.1).collect();
                inside.sort_by(f64::total_cmp);
                let k = rows.len() as f64;
                let (rms, wheels) = (
                    rows.iter().map(|r| r.2).sum::<f64>() / k,
                    rows.iter().map(|r| r.3).sum::<f64>() / k,
                );
                println!(
                    "{robots:2} robots {seconds:5} s {help:22} worst mean {:.3} {:.3} {:.3} inside least {:.3} 2 % {:.3} 10 % {:.3}; rms {rms:.3} wheels {wheels:.3}",
                    worst[0],
                    worst[1],
                    worst[2],
                    inside[0],
                    inside[inside.len() / 50],
                    inside[inside.len() / 10]
                );
            }
        }
    }
}
