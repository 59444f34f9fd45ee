//! The tables of `docs/accuracy-experiments.md`: settings of the product's fusion, compared on the same runs.
//!
//! ```text
//! cargo run --release -p coloc-sim --example compare_settings -- WORLD RUNS SCENARIO[,…]|all SETTINGS …
//! cargo run --release -p coloc-sim --example compare_settings -- ../shared/data/mrclam1 20 paper,one-dgps \
//!     beta=0.2,memory=0,lever=1 default beta=0.5,memory=0.5
//! ```
//!
//! SETTINGS are the defaults with changes: `beta`, `memory` \[s\], `lever` \[m\], `gate`, `half`, `determinant`, `paper`;
//! `cubature` (the paper's propagation) and `letter` (a sighting's noise dependent as far as the heading turns it); `seconds`, to end there;
//! of the sensors `hz` (relative poses) and `q` (factor of Q that filters believe); of the odometry's noise per sample `va`
//! \[m²/s²\] and `vb` of `a + b v²`, `wa` \[rad²/s²\] and `wc` of `a + c ω²`. Percentages compare the mean over robots of the logarithm
//! of RMS with that of the first SETTINGS, run by run, ± twice the standard error.

use std::error::Error;
use std::io::{Write, stderr, stdout};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use coloc_estimator::noise::OdometryNoise;
use coloc_estimator::settings::{Criterion, FusionSettings, GateWeight};
use coloc_estimator::{Propagation, Settings, Span};
use coloc_sim::evaluate::{EvalConfig, EvalReport, EvalWorld, RobotReport, evaluate};
use coloc_sim::method::{FilterSettings, Kind};
use coloc_sim::mrclam::Recording;
use coloc_sim::{Scenario, SyntheticConfig};

fn main() -> ExitCode {
    let Err(error) = run() else {
        return ExitCode::SUCCESS;
    };
    // Nobody is left to tell if standard error is closed.
    let _ = stderr().write_all(format!("compare_settings: {error}\n").as_bytes());
    ExitCode::FAILURE
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [world, runs, scenarios, settings @ ..] = arguments.as_slice() else {
        return Err("usage: WORLD RUNS SCENARIO[,…]|all SETTINGS …".into());
    };
    let mut config = EvalConfig::new(parse_world(world)?);
    config.runs = runs
        .parse()
        .map_err(|_| format!("`{runs}` is no number of runs, 1 to 65535"))?;
    config.methods = vec![Kind::Coloc];
    for scenario in parse_scenarios(scenarios)? {
        let (name, description) = (scenario.name, scenario.description);
        writeln!(stdout(), "{world}, {name}: {description}")?;
        config.scenario = scenario;
        compare(&config, settings)?;
    }
    Ok(())
}

fn parse_world(name: &str) -> Result<EvalWorld, Box<dyn Error>> {
    Ok(match name {
        "synthetic" => EvalWorld::Synthetic(SyntheticConfig::default()),
        folder => EvalWorld::Recorded(Arc::new(Recording::load(Path::new(folder))?.resample())),
    })
}

fn parse_scenarios(names: &str) -> Result<Vec<Scenario>, String> {
    if names == "all" {
        return Ok(Scenario::all());
    }
    let named = |name| Scenario::named(name).ok_or(format!("no scenario {name}"));
    names.split(',').map(named).collect()
}

fn compare(config: &EvalConfig, settings: &[String]) -> Result<(), Box<dyn Error>> {
    let mut first: Option<EvalReport> = None;
    for settings in settings {
        let mut config = config.clone();
        apply(settings, &mut config)?;
        let report = evaluate(&config, &|_| ())?;
        writeln!(
            stdout(),
            "  {settings:32} {}",
            line(&report, first.as_ref())
        )?;
        first.get_or_insert(report);
    }
    Ok(())
}

fn apply(settings: &str, config: &mut EvalConfig) -> Result<(), Box<dyn Error>> {
    let mut fusion = Settings::default().fusion;
    let mut propagation = Propagation::default();
    let mut odometry = OdometryNoise::paper();
    for setting in settings.split(',') {
        let (key, value) = setting.split_once('=').unwrap_or((setting, "nan"));
        let value: f64 = value
            .parse()
            .map_err(|_| format!("`{value}` is no number, for {key}"))?;
        match key {
            "default" => {}
            "paper" => fusion = FusionSettings::paper(),
            "beta" => fusion.damping = value,
            "memory" => fusion.memory = milliseconds(1000.0 * value),
            "lever" => fusion.heading_lever_m = value,
            "gate" => fusion.gate = value,
            "half" => fusion.gate_weight = GateWeight::Half,
            "determinant" => fusion.criterion = Criterion::Determinant,
            "cubature" => propagation = Propagation::Paper,
            "letter" => fusion.sighting_noise_is_own = false,
            "seconds" => config.seconds = Some(value),
            "hz" => config.scenario.sightings.rate_hz = value,
            "q" => config.scenario.noise_factor = value,
            "va" => odometry.forward.a = value,
            "vb" => odometry.forward.b = value,
            "wa" => odometry.turning.a = value,
            "wc" => odometry.turning.c = value,
            _ => return Err(format!("no setting {key}").into()),
        }
    }
    let mut filters = FilterSettings::new(&config.scenario, 0.02);
    filters.product.fusion = fusion;
    filters.product.propagation = propagation;
    if odometry != OdometryNoise::paper() {
        filters.odometry = odometry;
    }
    config.settings = Some(filters);
    Ok(())
}

#[allow(clippy::cast_possible_truncation)] // Saturates, which is what is wanted.
fn milliseconds(value: f64) -> Span {
    Span::from_millis(value.round() as i64)
}

fn line(report: &EvalReport, first: Option<&EvalReport>) -> String {
    let robots = robots(report);
    let worst = |value: fn(&RobotReport) -> f64| robots.iter().map(value).fold(0.0, f64::max);
    let last = robots.last().map_or([0.0; 3], |robot| robot.rms);
    let [x, y, phi] = mean(robots.iter().map(|robot| robot.rms));
    let differences = first.map_or(String::new(), |first| difference(report, first));
    format!(
        "last robot {:6.2} / {:6.2} cm / {:.4} rad; mean {:6.2} / {:6.2} / {phi:.4}; worst NEES {:5.2}, {:4.1} % outside; {differences}",
        100.0 * last[0],
        100.0 * last[1],
        last[2],
        100.0 * x,
        100.0 * y,
        worst(|robot| robot.nees),
        100.0 * worst(|robot| robot.nees_outside),
    )
}

fn robots(report: &EvalReport) -> &[RobotReport] {
    report
        .methods
        .first()
        .map_or(&[], |method| method.robots.as_slice())
}

#[allow(clippy::cast_precision_loss)] // Counts are far below 2^53.
fn mean(rows: impl ExactSizeIterator<Item = [f64; 3]>) -> [f64; 3] {
    let count = rows.len() as f64;
    rows.fold([0.0; 3], |sum, row| {
        std::array::from_fn(|i| sum[i] + row[i] / count)
    })
}

/// `[x, y, φ]` in percent: run by run, the mean over robots.
fn difference(report: &EvalReport, first: &EvalReport) -> String {
    let logarithms = |report: &EvalReport, run: usize| {
        let of_run = robots(report)
            .iter()
            .map(|robot| robot.rms_of_runs[run].map(f64::ln));
        mean(of_run)
    };
    let runs: Vec<[f64; 3]> = (0..usize::from(report.runs))
        .map(|run| {
            let [a, b] = [logarithms(report, run), logarithms(first, run)];
            std::array::from_fn(|i| a[i] - b[i])
        })
        .collect();
    let middle = mean(runs.iter().copied());
    let spread = mean(
        runs.iter()
            .map(|run| std::array::from_fn(|i| (run[i] - middle[i]).powi(2))),
    );
    // One run says nothing about the spread of runs.
    let degrees = f64::from(report.runs) - 1.0;
    let error = |i: usize| match (spread[i] / degrees).sqrt() {
        error if error.is_finite() => format!("{:.1}", 200.0 * error),
        _ => "–".into(),
    };
    let percent = |i: usize| format!("{:+.1} ± {} %", 100.0 * middle[i].exp_m1(), error(i));
    [0, 1, 2].map(percent).join(", ")
}
