//! Two leaders carry three children: the thesis's simulation with the robots of MR.CLAM 1, §3.6.2, cases 5 to 8.
//!
//! Ways and odometry are recorded, all else is made from the truth. The thesis says neither which recording it is, nor which robots lead,
//! nor how far robots see; its times without a leader say it: MR.CLAM 1, robots 1 and 3, 3 m. How it takes the wheels to err it does not
//! say either: here the variances of v and ω are 5.075 m²/s² and 0.345 rad²/s² in each sample, however slow the robot is.

mod bars;
pub mod picture;
mod world;

use rayon::prelude::*;

use super::Form;
use super::robot::Method;
use super::run;
use super::score::Score;
use crate::campaign::Finding;
use crate::honest::table::{Table, digits, percent};
use world::{CASES, CHILDREN, Case, LEADERS, Sensors, World};

/// The thesis leaves these times out of its figures (a): the first child hears of no leader \[s\].
const WITHOUT_LEADER_S: [[f64; 2]; 2] = [[118.8, 187.8], [701.8, 709.6]];

/// How the first child's figures are taken.
#[derive(Copy, Clone, PartialEq, Eq)]
enum Window {
    /// (a)
    WithLeader,
    /// (b)
    Whole,
}

impl Window {
    const ALL: [Self; 2] = [Self::WithLeader, Self::Whole];

    fn name(self) -> &'static str {
        match self {
            Self::WithLeader => "(a)",
            Self::Whole => "(b)",
        }
    }

    fn holds(self, time_s: f64) -> bool {
        let mut without = WITHOUT_LEADER_S.iter();
        self == Self::Whole || !without.any(|[from, to]| (*from..=*to).contains(&time_s))
    }
}

/// What came of a case.
struct Outcome<'a> {
    case: &'a Case,
    world: &'a World,
    score: Score,
}

impl<'a> Outcome<'a> {
    /// Of all runs.
    fn new(case: &'a Case, world: &'a World, form: &Form) -> Self {
        let runs = (0..form.runs).into_par_iter();
        let scores = runs.map(|it| {
            let sensors = Sensors::new(world, form.seed, it, case);
            run::score(&sensors, &Method::ALL)
        });
        let score = scores.reduce(Score::default, Score::merged);
        Self { case, world, score }
    }

    /// Of the first child: x and y \[m\] and φ \[rad\], mean and deviation.
    fn accuracy(&self, method: Method, window: Window) -> [[f64; 2]; 3] {
        let counts = |step| window.holds(self.world.time_s(step));
        self.score.accuracy(method, 0, counts)
    }
}

/// All cases.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let said = |text: String, missed| Finding {
        title: "Two leaders, three children".into(),
        text,
        missed,
    };
    let Some(data) = &form.data else {
        let skipped = "SKIPPED: no recordings; set COLOC_DATA to the folder that holds mrclam1\n";
        return said(skipped.into(), Vec::new());
    };
    let world = match World::read(data) {
        Ok(world) => world.shortened(|most| form.steps(50, most)),
        Err(error) => return said(String::new(), vec![error]),
    };
    let outcomes = CASES.iter().map(|case| Outcome::new(case, &world, form));
    let outcomes: Vec<Outcome<'_>> = outcomes.collect();
    let mut text = tables(&outcomes, form, &world);
    if !form.is_long() {
        text.push_str("\nToo little for the bars.\n");
        return said(text, Vec::new());
    }
    let (table, missed) = bars::held(&outcomes);
    text.push_str(&table);
    said(text, missed)
}

fn tables(outcomes: &[Outcome<'_>], form: &Form, world: &World) -> String {
    let (mut accuracy, mut honesty) = (
        Table::new(["case", "method", "", "x cm", "y cm", "φ rad"]),
        Table::new([
            "case",
            "method",
            "outside",
            "mean NEES",
            "NIS, leader 1",
            "NIS, leader 3",
        ]),
    );
    for outcome in outcomes {
        for method in Method::ALL {
            for window in Window::ALL {
                accuracy.row(accuracy_row(outcome, method, window));
            }
            honesty.row(honesty_row(outcome, method));
        }
    }
    let leaders = outcomes.iter().map(|outcome| {
        let outside = [0, 1].map(|leader| percent(outcome.score.leader_outside(leader)));
        format!("{} in case {}", outside.join(" and "), outcome.case.number)
    });
    let leaders: Vec<String> = leaders.collect();
    format!(
        "{} runs of {:.0} s each. RMSE over runs at each step, its mean and deviation over time, of the first child (robot 2); (a) leaves out \
         the times without a leader, (b) does not:\n\n{}\nShare of NEES beyond the 95 % bound and mean NEES (3 is honest) of robots 2, 4 \
         and 5, and share of NIS beyond it of what each leader said. Of the leaders' own NEES are outside: {}.\n\n{}",
        form.runs,
        world.time_s(world.steps()),
        accuracy.text(),
        leaders.join(", "),
        honesty.text()
    )
}

fn spread([mean, deviation]: [f64; 2]) -> String {
    format!("{:.2} ± {:.2}", 100.0 * mean, 100.0 * deviation)
}

fn accuracy_row(outcome: &Outcome<'_>, method: Method, window: Window) -> [String; 6] {
    let [x, y, phi] = outcome.accuracy(method, window);
    [
        outcome.case.number.to_string(),
        method.name().into(),
        window.name().into(),
        spread(x),
        spread(y),
        format!("{:.4} ± {:.4}", phi[0], phi[1]),
    ]
}

fn honesty_row(outcome: &Outcome<'_>, method: Method) -> [String; 6] {
    let each = |of: &dyn Fn(usize) -> String| {
        let children = 0..CHILDREN.len();
        children.map(of).collect::<Vec<_>>().join(", ")
    };
    let score = &outcome.score;
    let nis = |leader| each(&|child| percent(score.nis(method, child, leader)));
    [
        outcome.case.number.to_string(),
        method.name().into(),
        each(&|child| percent(score.outside(method, child))),
        each(&|child| digits(score.nees(method, child))),
        nis(0),
        nis(LEADERS.len() - 1),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_without_the_recording_and_no_folder_are_told_apart() {
        let without = find(&Form::short(1, None));
        assert!(without.text.starts_with("SKIPPED: ") && without.missed.is_empty());
        let folder = tempfile::tempdir().expect("a folder");
        let empty = find(&Form::short(1, Some(folder.path().into())));
        assert_eq!(empty.missed.len(), 1, "{empty:?}");
    }

    #[test]
    fn the_times_without_a_leader_are_left_out() {
        let [with, whole] = Window::ALL;
        for (time_s, is_in) in [
            (118.78, true),
            (118.82, false),
            (705.0, false),
            (709.7, true),
        ] {
            assert_eq!(with.holds(time_s), is_in);
            assert!(whole.holds(time_s));
        }
    }
}
