//! What each table says.

use coloc_sim::evaluate::{Comparison, EvalReport, MethodReport, NisReport, RobotReport};
use coloc_sim::method::Kind;
use coloc_sim::metrics::Paired;
use coloc_sim::promises::Promise;

use super::number::{cm, digits, or_dash, percent, rad, signed, whole_percent};
use super::table::Table;

/// What the robot with an index is called.
type Name<'a> = &'a dyn Fn(usize) -> String;

/// What was evaluated, in a line.
pub(crate) fn heading(world: &str, report: &EvalReport) -> String {
    #[allow(clippy::cast_precision_loss)] // Steps of a run.
    let seconds = report.steps.saturating_sub(1) as f64 * report.dt_s;
    format!(
        "{world}, {} ({}): {} robots, {seconds:.0} s, {} runs, seed {}",
        report.scenario.name, report.scenario.description, report.robots, report.runs, report.seed
    )
}

/// Everything about one scenario.
pub(crate) fn all(report: &EvalReport, name: Name<'_>) -> Vec<Table> {
    let mut tables = vec![
        errors(report, name),
        honesty(report, name),
        innovations(report, name),
        cost(report),
    ];
    tables.extend(paired(report, name));
    tables
}

/// A row for every robot and method.
fn per_robot(
    mut table: Table,
    report: &EvalReport,
    name: Name<'_>,
    cells: impl Fn(&RobotReport) -> Vec<String>,
) -> Table {
    for robot in 0..report.robots {
        for method in &report.methods {
            let mut row = vec![name(robot), method.method.name().into()];
            row.extend(cells(&method.robots[robot]));
            table.rows.push(row);
        }
    }
    table
}

fn errors(report: &EvalReport, name: Name<'_>) -> Table {
    let table = Table::new(
        "Errors: RMSE over runs, mean ± standard deviation over time; RMS over runs and time",
        &[
            "robot",
            "method",
            "x [cm]",
            "y [cm]",
            "heading [rad]",
            "RMS x [cm]",
            "RMS y [cm]",
            "RMS heading [rad]",
            "RMS position [cm]",
        ],
    );
    per_robot(table, report, name, |robot| {
        let (mean, deviation, rms) = (robot.rmse_mean, robot.rmse_deviation, robot.rms);
        let spread = |i: usize, unit: fn(f64) -> String| {
            format!("{} ± {}", unit(mean[i]), unit(deviation[i]))
        };
        vec![
            spread(0, cm),
            spread(1, cm),
            spread(2, rad),
            cm(rms[0]),
            cm(rms[1]),
            rad(rms[2]),
            cm(robot.rms_position),
        ]
    })
}

fn honesty(report: &EvalReport, name: Name<'_>) -> Table {
    let [low, high] = report.nees_band;
    let table = Table::new(
        format!(
            "Honesty: NEES (nominal 3; 5 % above its 95 % bound, 7.81); its mean over runs outside {low:.2} to {high:.2}; \
             within 3σ (nominal 99.7 %); credibility log₁₀(P/e²), below 0 overconfident"
        ),
        &[
            "robot",
            "method",
            "NEES",
            "above bound [%]",
            "mean below [%]",
            "mean above [%]",
            "3σ x [%]",
            "3σ y [%]",
            "3σ heading [%]",
            "cred. x",
            "cred. y",
            "cred. heading",
        ],
    );
    per_robot(table, report, name, |robot| {
        let mut cells = vec![digits(robot.nees), percent(robot.nees_outside)];
        cells.extend(robot.nees_outside_band.map(percent));
        cells.extend(robot.inside_3_sigma.map(percent));
        cells.extend(robot.credibility.map(digits));
        cells
    })
}

fn innovations(report: &EvalReport, name: Name<'_>) -> Table {
    let table = Table::new(
        "Innovations: NIS of what passed the gate (nominal 3 for neighbours' poses, 2 for fixes), share that did not, \
         how many there were in all runs",
        &[
            "robot",
            "method",
            "neighbours NIS",
            "gated [%]",
            "count",
            "fixes NIS",
            "gated [%]",
            "count",
        ],
    );
    per_robot(table, report, name, |robot| {
        let cells = |nis: &NisReport| {
            [
                or_dash(nis.mean, digits),
                or_dash(nis.gated_share, percent),
                format!("{:.0}", nis.count),
            ]
        };
        [cells(&robot.neighbours), cells(&robot.fixes)].concat()
    })
}

fn cost(report: &EvalReport) -> Table {
    let mut table = Table::new(
        "Cost: messages of the team, and time of all its estimators together for a step of 20 ms",
        &[
            "method",
            "",
            "messages per run",
            "bytes each",
            "kB/s",
            "time per step [µs]",
        ],
    );
    #[allow(clippy::cast_precision_loss)] // Steps of a run.
    let seconds = report.steps as f64 * report.dt_s;
    table.rows.extend(report.methods.iter().map(|method| {
        #[allow(clippy::cast_precision_loss)] // A hundred bytes.
        let bytes = method.messages_per_run * method.message_bytes as f64;
        vec![
            method.method.name().into(),
            String::new(),
            format!("{:.0}", method.messages_per_run),
            method.message_bytes.to_string(),
            digits(bytes / seconds / 1000.0),
            digits(method.time_per_step.as_secs_f64() * 1e6),
        ]
    }));
    table
}

/// The product, or what was asked for first, against each of the others; nothing to say with a single method or run.
fn paired(report: &EvalReport, name: Name<'_>) -> Option<Table> {
    let asked = || report.methods.iter().map(|method| method.method);
    let method = asked()
        .find(|&kind| kind == Kind::Coloc)
        .or(asked().next())?;
    let mut table = Table::new(
        format!(
            "{} less each other, RMS run by run: mean difference ± its 95 % confidence interval; * excludes 0",
            method.name()
        ),
        &[
            "robot",
            "against",
            "x [cm]",
            "x [%]",
            "y [cm]",
            "y [%]",
            "heading [rad]",
            "heading [%]",
            "position [cm]",
            "position [%]",
        ],
    );
    let pairs = report
        .comparisons
        .iter()
        .filter(|pair| pair.method == method);
    let mut pairs: Vec<&Comparison> = pairs.collect();
    pairs.sort_by_key(|pair| pair.robot);
    table.rows.extend(pairs.into_iter().map(|pair| {
        let [x, y, heading] = &pair.rms;
        let mut row = vec![name(pair.robot), pair.against.name().into()];
        for (difference, unit) in [
            (x, cm as fn(f64) -> String),
            (y, cm),
            (heading, rad),
            (&pair.position, cm),
        ] {
            row.extend([absolute(difference, unit), relative(difference)]);
        }
        row
    }));
    (!table.rows.is_empty() && report.runs > 1).then_some(table)
}

fn absolute(paired: &Paired, unit: fn(f64) -> String) -> String {
    let mark = if paired.is_significant() { "*" } else { "" };
    format!(
        "{} ± {}{mark}",
        signed(&unit(paired.difference)),
        unit(paired.half_width)
    )
}

fn relative(paired: &Paired) -> String {
    signed(&whole_percent(paired.relative))
}

/// All scenarios in one table: the last robot, which in the paper's setting has no receiver, and the worst of all.
pub(crate) fn summary(reports: &[EvalReport], name: Name<'_>) -> Vec<Table> {
    let last = reports
        .first()
        .map_or(0, |report| report.robots.saturating_sub(1));
    let mut table = Table::new(
        format!(
            "All scenarios: RMS of {} and of the worst robot, largest NEES and share above its bound of any robot",
            name(last)
        ),
        &[
            "scenario",
            "method",
            "x [cm]",
            "y [cm]",
            "heading [rad]",
            "worst position [cm]",
            "worst NEES",
            "above bound [%]",
        ],
    );
    for report in reports {
        for method in &report.methods {
            let mut row = vec![report.scenario.name.into(), method.method.name().into()];
            row.extend(summary_cells(method));
            table.rows.push(row);
        }
    }
    vec![table]
}

fn summary_cells(method: &MethodReport) -> Vec<String> {
    // Not a number where no robot has the figure.
    let worst = |figure: fn(&RobotReport) -> f64| {
        let figures = method.robots.iter().map(figure);
        figures.fold(f64::NAN, f64::max)
    };
    let [x, y, heading] = method
        .robots
        .last()
        .map_or([f64::NAN; 3], |robot| robot.rms);
    vec![
        cm(x),
        cm(y),
        rad(heading),
        cm(worst(|robot| robot.rms_position)),
        digits(worst(|robot| robot.nees)),
        percent(worst(|robot| robot.nees_outside)),
    ]
}

/// Every promise with what was found.
pub(crate) fn promises(promises: &[Promise]) -> Table {
    let mut table = Table::new("Promises", &["promise", "bar", "found", "kept"]);
    table.rows.extend(promises.iter().map(|promise| {
        let kept = if promise.kept { "yes" } else { "NO" };
        vec![
            promise.what.clone(),
            promise.bar.into(),
            promise.found.clone(),
            kept.into(),
        ]
    }));
    table
}
