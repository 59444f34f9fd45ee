//! What is asked of the methods, and whether it holds.

use super::super::robot::Method;
use super::{CHILDREN, Outcome, Window};
use crate::honest::table::{Table, digits, percent};

/// Of the first child in a case: what the thesis prints, and what an independent implementation of its fusion came to, 20 runs.
/// x and y \[cm\], φ \[rad\].
struct Stated {
    /// (a) and (b).
    printed: [[f64; 3]; 2],
    /// (a)
    kalman: [f64; 3],
    /// Of all children: share of NEES beyond the 95 % bound, in per cent.
    outside: [f64; 3],
}

const STATED: [Stated; 4] = [
    Stated {
        printed: [[4.11, 5.36, 0.0207], [7.36, 6.88, 0.0363]],
        kalman: [3.31, 4.28, 0.0199],
        outside: [6.3, 6.1, 8.1],
    },
    Stated {
        printed: [[5.29, 6.27, 0.0334], [8.85, 7.75, 0.0483]],
        kalman: [4.31, 5.53, 0.0241],
        outside: [11.6, 12.8, 13.1],
    },
    Stated {
        printed: [[8.31, 10.62, 0.0301], [11.89, 12.21, 0.0450]],
        kalman: [4.95, 6.27, 0.0233],
        outside: [20.7, 22.2, 22.0],
    },
    Stated {
        printed: [[11.92, 15.34, 0.0452], [15.38, 16.15, 0.0583]],
        kalman: [7.96, 9.97, 0.0297],
        outside: [32.2, 37.3, 36.2],
    },
];

/// In which unit they are stated \[m, m, rad\].
const COORDINATES: [(&str, f64); 3] = [("x", 0.01), ("y", 0.01), ("φ", 1.0)];

/// A bar, what was found of it at worst, and where it was missed.
struct Bar {
    what: String,
    worst: f64,
    in_words: fn(f64) -> String,
    missed: Vec<String>,
}

impl Bar {
    fn new(what: String, in_words: fn(f64) -> String) -> Self {
        Self {
            what,
            worst: f64::NEG_INFINITY,
            in_words,
            missed: Vec::new(),
        }
    }

    /// In `place`, `found` is to be no more than `most`.
    fn most(&mut self, most: f64, found: f64, place: &str) {
        self.worst = self.worst.max(found);
        if found > most || found.is_nan() {
            let found = (self.in_words)(found);
            let missed = format!("{}: {found} in {place}", self.what);
            self.missed.push(missed);
        }
    }

    fn row(&self) -> [String; 3] {
        let verdict = if self.missed.is_empty() {
            "PASS"
        } else {
            "MISSED"
        };
        let worst = (self.in_words)(self.worst);
        [self.what.clone(), worst, verdict.into()]
    }
}

/// All bars as a table, and a line for each that is missed.
pub(super) fn held(outcomes: &[Outcome<'_>]) -> (String, Vec<String>) {
    let bars = [
        as_stated(outcomes),
        share_as_stated(outcomes),
        as_accurate(outcomes),
        outside(outcomes, Method::Cross, 0.05),
        mean_nees(outcomes),
        outside(outcomes, Method::Split, 0.03),
        better_than_printed(outcomes),
        outside(outcomes, Method::Default, 0.05),
    ];
    let mut table = Table::new(["bar", "at worst", ""]);
    for bar in &bars {
        table.row(bar.row());
    }
    let missed = bars.into_iter().flat_map(|it| it.missed).collect();
    (format!("\n{}", table.text()), missed)
}

/// Every coordinate of the first child in every case, in `window`: what is found over what is `asked`.
fn ratios(
    bar: &mut Bar,
    outcomes: &[Outcome<'_>],
    (method, window): (Method, Window),
    asked: impl Fn(&Outcome<'_>, &Stated, usize) -> f64,
    far: impl Fn(&mut Bar, f64, &str),
) {
    for (outcome, stated) in outcomes.iter().zip(&STATED) {
        let found = outcome.accuracy(method, window);
        for (i, (name, _)) in COORDINATES.iter().enumerate() {
            let ratio = found[i][0] / asked(outcome, stated, i);
            let place = format!("case {} {}, {name}", outcome.case.number, window.name());
            far(bar, ratio, &place);
        }
    }
}

fn off_by(ratio: f64) -> f64 {
    (ratio - 1.0).abs()
}

fn as_stated(outcomes: &[Outcome<'_>]) -> Bar {
    let what = "leader-kf, RMSE (a): off what is stated by at most 5 %";
    let mut bar = Bar::new(what.into(), percent);
    ratios(
        &mut bar,
        outcomes,
        (Method::Kalman, Window::WithLeader),
        |_, stated, i| stated.kalman[i] * COORDINATES[i].1,
        |bar, ratio, place| bar.most(0.05, off_by(ratio), place),
    );
    bar
}

fn as_accurate(outcomes: &[Outcome<'_>]) -> Bar {
    let what = "leader-cross, RMSE (a): off leader-kf's by at most 5 %";
    let mut bar = Bar::new(what.into(), percent);
    ratios(
        &mut bar,
        outcomes,
        (Method::Cross, Window::WithLeader),
        |outcome, _, i| outcome.accuracy(Method::Kalman, Window::WithLeader)[i][0],
        |bar, ratio, place| bar.most(0.05, off_by(ratio), place),
    );
    bar
}

fn better_than_printed(outcomes: &[Outcome<'_>]) -> Bar {
    let what = "leader-default, RMSE (a) and (b): below what the thesis prints";
    let mut bar = Bar::new(what.into(), |ratio| format!("{ratio:.2} of it"));
    for (number, window) in Window::ALL.into_iter().enumerate() {
        ratios(
            &mut bar,
            outcomes,
            (Method::Default, window),
            |_, stated, i| stated.printed[number][i] * COORDINATES[i].1,
            |bar, ratio, place| bar.most(1.0, ratio, place),
        );
    }
    bar
}

/// Every child in every case.
fn each(outcomes: &[Outcome<'_>], mut look: impl FnMut(&Outcome<'_>, &Stated, usize, &str)) {
    for (outcome, stated) in outcomes.iter().zip(&STATED) {
        for (child, robot) in CHILDREN.iter().enumerate() {
            let place = format!("case {}, robot {}", outcome.case.number, robot.0);
            look(outcome, stated, child, &place);
        }
    }
}

/// How far the stated share is beyond the 99 % interval of ours.
fn share_as_stated(outcomes: &[Outcome<'_>]) -> Bar {
    let what =
        "leader-kf: what is stated is inside the 99 % interval of our share outside, but for";
    let mut bar = Bar::new(what.into(), percent);
    each(outcomes, |outcome, stated, child, place| {
        let share = 0.01 * stated.outside[child];
        let [low, high] = outcome.score.interval(Method::Kalman, child);
        let beyond = (low - share).max(share - high).max(0.0);
        bar.most(0.0, beyond, place);
    });
    bar
}

fn outside(outcomes: &[Outcome<'_>], method: Method, most: f64) -> Bar {
    let what = format!("{}: at most {} outside", method.name(), percent(most));
    let mut bar = Bar::new(what, percent);
    each(outcomes, |outcome, _, child, place| {
        bar.most(most, outcome.score.outside(method, child), place);
    });
    bar
}

fn mean_nees(outcomes: &[Outcome<'_>]) -> Bar {
    let what = "leader-cross: mean NEES at most 3.3";
    let mut bar = Bar::new(what.into(), digits);
    each(outcomes, |outcome, _, child, place| {
        bar.most(3.3, outcome.score.nees(Method::Cross, child), place);
    });
    bar
}
