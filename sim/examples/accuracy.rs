//! The table of `docs/accuracy.md` for any recording or the synthetic world:
//!
//! ```text
//! cargo run --release -p coloc-sim --example accuracy -- ../shared/data/mrclam1 20 [METHOD …]
//! cargo run --release -p coloc-sim --example accuracy -- synthetic 20 [METHOD …]
//! ```
//!
//! The scenario is taken from the environment: `SCENARIO=one-way`.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use coloc_sim::evaluate::{EvalConfig, EvalWorld, RobotReport, evaluate};
use coloc_sim::method::Kind;
use coloc_sim::mrclam::Recording;
use coloc_sim::{Scenario, SyntheticConfig};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let world = arguments
        .next()
        .ok_or("which recording? a folder, or: synthetic")?;
    let world = match world.as_str() {
        "synthetic" => EvalWorld::Synthetic(SyntheticConfig::default()),
        folder => EvalWorld::Recorded(Arc::new(Recording::load(Path::new(folder))?.resample())),
    };
    let mut config = EvalConfig::new(world);
    config.runs = arguments
        .next()
        .map_or(Ok(config.runs), |runs| runs.parse())?;
    let methods: Vec<Kind> = arguments
        .map(|name| Kind::named(&name).ok_or(format!("no method {name}")))
        .collect::<Result<_, _>>()?;
    if !methods.is_empty() {
        config.methods = methods;
    }
    if let Ok(name) = std::env::var("SCENARIO") {
        config.scenario = Scenario::named(&name).ok_or(format!("no scenario {name}"))?;
    }
    let report = evaluate(&config, &|_| ())?;
    for method in &report.methods {
        println!(
            "{} ({:.2?} per step)",
            method.method.name(),
            method.time_per_step
        );
        for (robot, figures) in method.robots.iter().enumerate() {
            println!("  R{}: {}", robot + 1, line(figures));
        }
    }
    Ok(())
}

fn line(figures: &RobotReport) -> String {
    let [x, y, phi] = figures.rmse_mean;
    let [dx, dy, dphi] = figures.rmse_deviation;
    let [rx, ry, rphi] = figures.rms;
    format!(
        "mean {:.2}±{:.2} / {:.2}±{:.2} cm / {phi:.4}±{dphi:.4} rad; RMS {:.2} / {:.2} / {rphi:.4}; NEES {:.2}, {:.1} % outside; in 3σ {:.1?} %",
        100.0 * x,
        100.0 * dx,
        100.0 * y,
        100.0 * dy,
        100.0 * rx,
        100.0 * ry,
        figures.nees,
        100.0 * figures.nees_outside,
        figures.inside_3_sigma.map(|share| 100.0 * share)
    )
}
