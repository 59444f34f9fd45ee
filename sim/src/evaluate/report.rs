//! What an evaluation found: tables, comparisons and series to plot. The same seed gives the same bytes.

use std::time::Duration;

use serde::Serialize;

use super::config::EvalConfig;
use super::gather::{Gather, RobotGather, stride};
use crate::method::Kind;
use crate::metrics::statistics::{mean_and_deviation, nees_band};
use crate::metrics::{NisTotals, Paired};
use crate::scenario::Scenario;

/// Result of an evaluation. Arrays of three are x \[m\], y \[m\], heading \[rad\].
#[derive(Clone, Debug, Serialize)]
pub struct EvalReport {
    /// The sensors.
    pub scenario: Scenario,
    /// Robots in the world.
    pub robots: usize,
    /// Steps per run.
    pub steps: usize,
    /// Length of a step \[s\].
    pub dt_s: f64,
    /// Runs.
    pub runs: u16,
    /// The seed of all randomness.
    pub seed: u64,
    /// 95 % interval of a consistent filter's NEES, averaged over the runs.
    pub nees_band: [f64; 2],
    /// In the order asked for.
    pub methods: Vec<MethodReport>,
    /// Every pair of methods for each robot.
    pub comparisons: Vec<Comparison>,
    /// Where the robots were in the first run.
    pub truth: Vec<TruthPath>,
}

/// One method.
#[derive(Clone, Debug, Serialize)]
pub struct MethodReport {
    /// Which.
    pub method: Kind,
    /// In the order of the world.
    pub robots: Vec<RobotReport>,
    /// Sent per run, by all robots together.
    pub messages_per_run: f64,
    /// What a message holds: eight bytes for each number. The mean, where messages differ.
    pub message_bytes: usize,
    /// Spent per step by the whole team's estimators; not serialized, since it differs from machine to machine.
    #[serde(skip)]
    pub time_per_step: Duration,
}

/// One method's figures for one robot.
#[derive(Clone, Debug, Serialize)]
pub struct RobotReport {
    /// Time mean of the RMSE over runs.
    pub rmse_mean: [f64; 3],
    /// Its standard deviation over time.
    pub rmse_deviation: [f64; 3],
    /// RMS over runs and time.
    pub rms: [f64; 3],
    /// RMS distance \[m\].
    pub rms_position: f64,
    /// Mean NEES, nominal 3.
    pub nees: f64,
    /// Share of samples above the 95 % quantile, nominal 0.05.
    pub nees_outside: f64,
    /// Share of steps at which the NEES averaged over runs is below, and above, its band; no number where the truth is never known.
    pub nees_outside_band: [f64; 2],
    /// Share of samples within 3σ.
    pub inside_3_sigma: [f64; 3],
    /// log₁₀ of mean variance over mean square error.
    pub credibility: [f64; 3],
    /// Poses received (in `ccl`: sightings of this robot).
    pub neighbours: NisReport,
    /// Fixes.
    pub fixes: NisReport,
    /// RMS of each run.
    pub rms_of_runs: Vec<[f64; 3]>,
    /// RMS distance of each run \[m\].
    pub rms_position_of_runs: Vec<f64>,
    /// To plot.
    pub series: Series,
}

/// Innovations of one sensor.
#[derive(Copy, Clone, Debug, Serialize)]
pub struct NisReport {
    /// Mean of those that passed the gate.
    pub mean: Option<f64>,
    /// Share that did not pass.
    pub gated_share: Option<f64>,
    /// How many there were, all runs.
    pub count: f64,
}

/// Decimated series over time; `None` where nobody knows the truth.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Series {
    /// \[s\]
    pub time_s: Vec<f64>,
    /// Mean over runs.
    pub mean_error: Vec<Option<[f64; 3]>>,
    /// Three times the root of the mean variance.
    pub three_sigma: Vec<Option<[f64; 3]>>,
    /// Over runs.
    pub rmse: Vec<Option<[f64; 3]>>,
    /// Mean over runs.
    pub nees: Vec<Option<f64>>,
    /// Error in the first run; added to the truth it is the estimated path.
    pub first_run_error: Vec<Option<[f64; 3]>>,
}

/// One robot's decimated truth.
#[derive(Clone, Debug, Serialize)]
pub struct TruthPath {
    /// `[x, y, φ]` at the times of the series.
    pub pose: Vec<Option<[f64; 3]>>,
}

/// Two methods on the same runs.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// This one's RMS of each run …
    pub method: Kind,
    /// … less this one's.
    pub against: Kind,
    /// From 0.
    pub robot: usize,
    /// RMS.
    pub rms: [Paired; 3],
    /// RMS distance.
    pub position: Paired,
}

pub(super) fn report(config: &EvalConfig, gathers: &[Gather]) -> EvalReport {
    let world = config.world(0);
    let dt_s = world.dt_s();
    let every = stride(config);
    let band = nees_band(config.runs.into());
    let named = config.methods.iter().zip(gathers);
    let methods: Vec<MethodReport> = named
        .map(|(&kind, gather)| method(kind, gather, config, &Axis { every, dt_s, band }))
        .collect();
    let path = |robot| {
        let steps = (0..config.steps()).step_by(every);
        TruthPath {
            pose: steps
                .map(|step| world.truth(step, robot).map(|p| [p.x, p.y, p.phi]))
                .collect(),
        }
    };
    EvalReport {
        scenario: config.scenario.clone(),
        robots: world.robots(),
        steps: config.steps(),
        dt_s,
        runs: config.runs,
        seed: config.seed,
        nees_band: band,
        comparisons: comparisons(&methods),
        methods,
        truth: (0..world.robots()).map(path).collect(),
    }
}

struct Axis {
    every: usize,
    dt_s: f64,
    band: [f64; 2],
}

#[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation)] // Counts are far below 2^32.
fn method(kind: Kind, gather: &Gather, config: &EvalConfig, axis: &Axis) -> MethodReport {
    let steps = (config.steps() as u32)
        .saturating_mul(config.runs.into())
        .max(1);
    MethodReport {
        method: kind,
        messages_per_run: gather.sent.messages as f64 / f64::from(config.runs),
        message_bytes: usize::try_from(gather.sent.bytes / gather.sent.messages.max(1))
            .unwrap_or(usize::MAX),
        time_per_step: gather.time / steps,
        robots: gather
            .robots
            .iter()
            .map(|robot| robot_report(robot, axis))
            .collect(),
    }
}

fn robot_report(robot: &RobotGather, axis: &Axis) -> RobotReport {
    let rmse: Vec<[f64; 3]> = robot
        .steps
        .iter()
        .filter_map(crate::metrics::StepTotals::rmse)
        .collect();
    let over_time: [[f64; 2]; 3] = std::array::from_fn(|i| {
        mean_and_deviation(&rmse.iter().map(|rmse| rmse[i]).collect::<Vec<_>>())
    });
    RobotReport {
        rmse_mean: over_time.map(|[mean, _]| mean),
        rmse_deviation: over_time.map(|[_, deviation]| deviation),
        rms: robot.totals.rms(),
        rms_position: robot.totals.rms_position(),
        nees: robot.totals.nees(),
        nees_outside: robot.totals.nees_outside(),
        nees_outside_band: outside_band(robot, axis.band),
        inside_3_sigma: robot.totals.inside_3_sigma(),
        credibility: robot.totals.credibility(),
        neighbours: nis(&robot.neighbours),
        fixes: nis(&robot.fixes),
        rms_of_runs: robot.runs.iter().map(crate::metrics::Totals::rms).collect(),
        rms_position_of_runs: robot
            .runs
            .iter()
            .map(crate::metrics::Totals::rms_position)
            .collect(),
        series: series(robot, axis),
    }
}

fn nis(totals: &NisTotals) -> NisReport {
    NisReport {
        mean: totals.mean(),
        gated_share: totals.gated_share(),
        count: totals.accepted + totals.gated,
    }
}

#[allow(clippy::cast_precision_loss)] // Counts are far below 2^53.
fn outside_band(robot: &RobotGather, [low, high]: [f64; 2]) -> [f64; 2] {
    let known: Vec<f64> = robot
        .steps
        .iter()
        .filter(|step| step.count > 0.0)
        .map(|step| step.nees / step.count)
        .collect();
    let share = |outside: &dyn Fn(f64) -> bool| {
        known.iter().filter(|nees| outside(**nees)).count() as f64 / known.len() as f64
    };
    [share(&|nees| nees < low), share(&|nees| nees > high)]
}

#[allow(clippy::cast_precision_loss)] // Steps are far below 2^53.
fn series(robot: &RobotGather, axis: &Axis) -> Series {
    let mut series = Series {
        first_run_error: robot.first_run.clone(),
        ..Series::default()
    };
    for (step, totals) in robot.steps.iter().enumerate().step_by(axis.every) {
        let known = (totals.count > 0.0).then_some(totals.count);
        series.time_s.push(step as f64 * axis.dt_s);
        series
            .mean_error
            .push(known.map(|count| totals.errors.map(|sum| sum / count)));
        series
            .three_sigma
            .push(known.map(|count| totals.variances.map(|sum| 3.0 * (sum / count).sqrt())));
        series.rmse.push(totals.rmse());
        series.nees.push(known.map(|count| totals.nees / count));
    }
    series
}

fn comparisons(methods: &[MethodReport]) -> Vec<Comparison> {
    let pairs = methods
        .iter()
        .flat_map(|a| methods.iter().map(move |b| (a, b)));
    let different = pairs.filter(|(a, b)| a.method != b.method);
    different
        .flat_map(|(a, b)| (0..a.robots.len()).map(move |robot| compare(a, b, robot)))
        .collect()
}

fn compare(a: &MethodReport, b: &MethodReport, robot: usize) -> Comparison {
    let column = |of: &MethodReport, i: usize| {
        of.robots[robot]
            .rms_of_runs
            .iter()
            .map(|rms| rms[i])
            .collect::<Vec<_>>()
    };
    Comparison {
        method: a.method,
        against: b.method,
        robot,
        rms: std::array::from_fn(|i| Paired::new(&column(a, i), &column(b, i))),
        position: Paired::new(
            &a.robots[robot].rms_position_of_runs,
            &b.robots[robot].rms_position_of_runs,
        ),
    }
}
