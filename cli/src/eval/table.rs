//! The evaluation as a person reads it: a line for each method and robot, then what the product gains over its rivals.

use coloc_sim::evaluate::{Comparison, EvalReport, MethodReport, RobotReport};
use coloc_sim::method::Kind;

const HEADER: [&str; 2] = [
    "                 RMSE over runs, its mean ± std over time        RMS over time             NEES (3 is honest)         inside 3σ [%]",
    "method     robot  x [cm]       y [cm]       φ [rad]         |  x [cm] y [cm] φ [rad] |     mean beyond 95 %  band -/+ % |     x     y     φ",
];

/// The whole table. Of the NEES, averaged over runs, a share of 5 % is beyond what holds 95 % of honest estimates, and of the
/// time 5 % outside of its band: below it the uncertainty is too large, above it too small.
#[allow(clippy::cast_precision_loss)] // Steps of a run.
pub(crate) fn lines(report: &EvalReport) -> Vec<String> {
    let seconds = report.steps.saturating_sub(1) as f64 * report.dt_s;
    let (scenario, runs, seed) = (&report.scenario, report.runs, report.seed);
    let title = format!(
        "{}: {}; {runs} runs of {seconds:.0} s, seed {seed}",
        scenario.name, scenario.description
    );
    let mut lines = vec![title, String::new()];
    lines.extend(HEADER.map(str::to_owned));
    for method in &report.methods {
        lines.extend(
            method
                .robots
                .iter()
                .enumerate()
                .map(|(robot, figures)| row(method.method, robot, figures)),
        );
    }
    lines.push(String::new());
    lines.extend(report.methods.iter().map(cost));
    lines.push(String::new());
    lines.extend(
        report
            .comparisons
            .iter()
            .filter(|pair| pair.method == Kind::Coloc)
            .map(gain),
    );
    lines
}

fn row(method: Kind, robot: usize, figures: &RobotReport) -> String {
    let cm = |metres: f64| 100.0 * metres;
    let ([x, y, phi], [dx, dy, dphi]) = (figures.rmse_mean, figures.rmse_deviation);
    let [rx, ry, rphi] = figures.rms;
    let inside = figures.inside_3_sigma.map(|share| 100.0 * share);
    let outside = 100.0 * figures.nees_outside;
    let [below, above] = figures.nees_outside_band.map(|share| 100.0 * share);
    format!(
        "{:<10} R{:<3} {:>7.2}±{:<5.2} {:>6.2}±{:<5.2} {phi:>7.4}±{dphi:<6.4} | {:>7.2} {:>6.2} {rphi:>7.4} | {:>8.3} {outside:>9.1} % {below:>5.1}/{above:<5.1} | {:>5.1} {:>5.1} {:>5.1}",
        method.name(),
        robot + 1,
        cm(x),
        cm(dx),
        cm(y),
        cm(dy),
        cm(rx),
        cm(ry),
        figures.nees,
        inside[0],
        inside[1],
        inside[2],
    )
}

fn cost(method: &MethodReport) -> String {
    format!(
        "{:<10} {:>10.0} messages of {:>3} bytes a run, {:>8.2} µs a step of the whole team",
        method.method.name(),
        method.messages_per_run,
        method.message_bytes,
        method.time_per_step.as_secs_f64() * 1e6,
    )
}

/// Negative is better.
fn gain(pair: &Comparison) -> String {
    let [x, y, phi] = pair.rms;
    let percent = |paired: coloc_sim::metrics::Paired| {
        let sure = if paired.is_significant() {
            ""
        } else {
            " (not significant)"
        };
        format!("{:+.1} %{sure}", 100.0 * paired.relative)
    };
    format!(
        "coloc against {:<10} R{}: RMS x {}, y {}, φ {}",
        pair.against.name(),
        pair.robot + 1,
        percent(x),
        percent(y),
        percent(phi)
    )
}
