//! What the project promises about the first MR.CLAM recording, and whether it holds.
//!
//! The reference figures were made with an independent implementation of the same methods (20 runs, other noise).

use crate::Scenario;
use crate::evaluate::{
    EvalConfig, EvalError, EvalReport, EvalWorld, Progress, RobotReport, evaluate,
};
use crate::method::Kind;

/// One promise, and what was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Promise {
    /// About what.
    pub what: String,
    /// What is promised.
    pub bar: &'static str,
    /// What was found.
    pub found: String,
    /// Whether it holds.
    pub kept: bool,
}

/// Robots of that recording.
const TEAM: usize = 5;

/// A method's figures of R5 and R1: `[x m, y m, heading rad]`.
struct Reference {
    method: Kind,
    tolerance: f64,
    bar: &'static str,
    /// Time mean of R5's RMSE over 20 runs.
    mean: [f64; 3],
    /// R5's RMS.
    rms: [f64; 3],
    /// R1's RMS.
    rms_r1: [f64; 3],
}

const REFERENCES: [Reference; 6] = [
    reference(
        Kind::Sl,
        [1.02, 3.70, 1.095],
        [1.20, 4.34, 1.179],
        [0.0220, 0.0221, 0.107],
    ),
    naive(
        [0.0437, 0.0355, 0.0222],
        [0.0636, 0.0394, 0.0261],
        [0.0355, 0.0280, 0.0256],
    ),
    reference(
        Kind::Ci,
        [0.0799, 0.0781, 0.0321],
        [0.0913, 0.0884, 0.0387],
        [0.0280, 0.0277, 0.0350],
    ),
    reference(
        Kind::SplitCi,
        [0.0399, 0.0386, 0.0249],
        [0.0474, 0.0451, 0.0287],
        [0.0254, 0.0250, 0.0281],
    ),
    reference(
        Kind::Damped,
        [0.0249, 0.0259, 0.0223],
        [0.0290, 0.0320, 0.0279],
        [0.0196, 0.0195, 0.0251],
    ),
    reference(
        Kind::Ccl,
        [0.0198, 0.0185, 0.0132],
        [0.0245, 0.0204, 0.0154],
        [0.0157, 0.0180, 0.0152],
    ),
];

const fn reference(method: Kind, mean: [f64; 3], rms: [f64; 3], rms_r1: [f64; 3]) -> Reference {
    Reference {
        method,
        tolerance: 0.1,
        bar: "within 10 %",
        mean,
        rms,
        rms_r1,
    }
}

/// Wildly overconfident, so chance has more room.
const fn naive(mean: [f64; 3], rms: [f64; 3], rms_r1: [f64; 3]) -> Reference {
    Reference {
        tolerance: 0.25,
        bar: "within 25 %",
        ..reference(Kind::Nb, mean, rms, rms_r1)
    }
}

/// Holds every promise against `runs` runs in `world`, which is the first MR.CLAM recording.
/// Time means are held against their reference with 20 runs or more: with fewer they are smaller by nature.
///
/// # Errors
/// What makes no sense in an evaluation, or another team.
pub fn promises(
    world: &EvalWorld,
    runs: u16,
    seed: u64,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<Promise>, EvalError> {
    let run = |scenario: &str, methods: &[Kind]| {
        let config = EvalConfig {
            scenario: Scenario::named(scenario).unwrap_or_default(),
            methods: methods.to_vec(),
            runs,
            seed,
            ..EvalConfig::new(world.clone())
        };
        evaluate(&config, progress)
    };
    check_team(EvalConfig::new(world.clone()).robots())?;
    let referred = REFERENCES.map(|reference| reference.method);
    let methods: Vec<Kind> = referred.into_iter().chain([Kind::Coloc]).collect();
    let paper = run("paper", &methods)?;
    let mut found = references(&paper, runs);
    found.extend((2..5).flat_map(|robot| against_the_paper(&paper, robot)));
    found.extend(honesty(&paper));
    found.push(against_the_bound(&paper));
    found.extend(one_way(&run("one-way", &[Kind::SplitCi, Kind::Coloc])?));
    for scenario in ["one-dgps", "one-dgps-slow"] {
        found.push(one_receiver(&run(scenario, &[Kind::Coloc])?));
    }
    Ok(found)
}

/// Promises about robots that are not there would be kept.
fn check_team(robots: usize) -> Result<(), EvalError> {
    (robots == TEAM)
        .then_some(())
        .ok_or(EvalError::OtherTeam(robots))
}

/// The robots of a method that was evaluated, the last being R5.
fn robots(report: &EvalReport, kind: Kind) -> &[RobotReport] {
    let mut methods = report.methods.iter();
    let found = methods.find(|method| method.method == kind);
    found.map_or(&[], |method| &method.robots)
}

fn references(report: &EvalReport, runs: u16) -> Vec<Promise> {
    let mut promises = Vec::new();
    for reference in &REFERENCES {
        let [first, .., last] = robots(report, reference.method) else {
            continue;
        };
        let mut compare = |what: &str, found: [f64; 3], wanted: [f64; 3]| {
            let off = [0, 1, 2].map(|i| found[i] / wanted[i] - 1.0);
            let [x, y, heading] = off.map(|off| format!("{:+.1} %", 100.0 * off));
            promises.push(Promise {
                what: format!("{}, {what}, against the reference", reference.method.name()),
                bar: reference.bar,
                found: format!("x {x}, y {y}, heading {heading}"),
                kept: off.iter().all(|off| off.abs() <= reference.tolerance),
            });
        };
        compare("R5 RMS", last.rms, reference.rms);
        compare("R1 RMS", first.rms, reference.rms_r1);
        if runs >= 20 {
            compare("R5 time mean", last.rmse_mean, reference.mean);
        }
    }
    promises
}

fn against_the_paper(report: &EvalReport, robot: usize) -> Vec<Promise> {
    let mut pairs = report.comparisons.iter();
    let pair = pairs.find(|pair| {
        (pair.method, pair.against, pair.robot) == (Kind::Coloc, Kind::SplitCi, robot)
    });
    let Some([x, y, heading]) = pair.map(|pair| &pair.rms) else {
        return Vec::new();
    };
    let name = format!("R{}: coloc against split-ci, RMS", robot + 1);
    let better = Promise {
        what: format!("{name} x, y"),
        bar: "≥ 25 % lower, 95 % interval without 0",
        found: [x, y]
            .map(|pair| {
                let (difference, half) = (100.0 * pair.difference, 100.0 * pair.half_width);
                format!(
                    "{:+.0} % ({difference:+.2} ± {half:.2} cm)",
                    100.0 * pair.relative
                )
            })
            .join(", "),
        kept: [x, y]
            .iter()
            .all(|pair| pair.relative <= -0.25 && pair.is_significant()),
    };
    let no_worse = Promise {
        what: format!("{name} heading"),
        bar: "≤ 3 % higher",
        found: format!("{:+.1} %", 100.0 * heading.relative),
        kept: heading.relative <= 0.03,
    };
    vec![better, no_worse]
}

fn honesty(report: &EvalReport) -> [Promise; 2] {
    let shares = |kind| robots(report, kind).iter().map(|robot| robot.nees_outside);
    let worst = shares(Kind::Coloc).fold(0.0, f64::max);
    let control = shares(Kind::Nb).fold(1.0, f64::min);
    [
        Promise {
            what: "coloc: NEES outside its 95 % bound, worst robot".into(),
            bar: "≤ 5 %",
            found: format!("{:.1} %", 100.0 * worst),
            kept: worst <= 0.05,
        },
        Promise {
            what: "nb: the same, best robot (a control: the metric can fail)".into(),
            bar: "> 50 %",
            found: format!("{:.1} %", 100.0 * control),
            kept: control > 0.5,
        },
    ]
}

fn against_the_bound(report: &EvalReport) -> Promise {
    let rms = |kind| {
        robots(report, kind)
            .last()
            .map_or(f64::NAN, |robot| robot.rms_position)
    };
    let ratio = rms(Kind::Coloc) / rms(Kind::Ccl);
    Promise {
        what: "R5: coloc / ccl, RMS position".into(),
        bar: "≤ 1.6, better 1.3",
        found: format!("{ratio:.2}"),
        kept: ratio <= 1.6,
    }
}

/// R1 sees everybody and is seen by nobody: the others receive.
fn one_way(report: &EvalReport) -> [Promise; 2] {
    let nees = |kind| robots(report, kind).iter().skip(1).map(|robot| robot.nees);
    let list = |kind| {
        nees(kind)
            .map(|nees| format!("{nees:.2}"))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let promise = |kind: Kind, bar, kept| Promise {
        what: format!("one-way sensing, {}: NEES of R2 to R5", kind.name()),
        bar,
        found: list(kind),
        kept,
    };
    [
        promise(
            Kind::Coloc,
            "≤ 3",
            nees(Kind::Coloc).all(|nees| nees <= 3.0),
        ),
        promise(
            Kind::SplitCi,
            "> 4",
            nees(Kind::SplitCi).all(|nees| nees > 4.0),
        ),
    ]
}

fn one_receiver(report: &EvalReport) -> Promise {
    let robot = robots(report, Kind::Coloc).last();
    let [x, y] = robot.map_or([f64::NAN; 2], |robot| [robot.rms[0], robot.rms[1]]);
    Promise {
        what: format!(
            "{} ({}): R5 RMS x, y",
            report.scenario.name, report.scenario.description
        ),
        bar: "≤ 12 cm",
        found: format!("{:.1} cm, {:.1} cm", 100.0 * x, 100.0 * y),
        kept: x.max(y) <= 0.12,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_team_is_refused() {
        assert_eq!(check_team(5), Ok(()));
        for robots in [0, 1, 4, 6] {
            assert_eq!(check_team(robots), Err(EvalError::OtherTeam(robots)));
        }
    }
}
