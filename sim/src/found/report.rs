//! Tables of what came of it.

use rayon::prelude::*;

use super::Form;
use super::bar::{Bar, Honesty, median, seconds};
use super::experiment::Experiment;
use super::outcome::Outcome;
use super::robot;
use crate::honest::table::Table;

/// Bars that are missed, by parts of their lines; `docs/lost.md` says why.
const KNOWN: [[&str; 2]; 4] = [
    ["drifts at", "ok and wrong for more than 3 s"],
    ["standing", "ok and wrong after 6 s"],
    ["standing", "followed wrongly"],
    ["five times as wrong", "followed wrongly"],
];

fn is_known(line: &str) -> bool {
    KNOWN
        .iter()
        .any(|parts| parts.iter().all(|part| line.contains(part)))
}

/// The robots of a row.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) name: String,
    pub(super) outcomes: Vec<Outcome>,
    pub(super) bars: Vec<Bar>,
    pub(super) document: String,
    pub(super) beyond: bool,
}

/// What came of a part.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Of the part.
    pub title: String,
    /// The table, in Markdown.
    pub text: String,
    /// Every bar that was missed, in a line.
    pub missed: Vec<String>,
    /// Those that are missed for a reason that is known.
    pub known: Vec<String>,
    /// Of all of its robots.
    pub honesty: Honesty,
}

/// Runs the robots of an experiment.
#[must_use]
pub(super) fn row(experiment: &Experiment, form: &Form) -> Row {
    let robots = form.robots(experiment.robots);
    let outcomes = if let Some(only) = form.robot {
        vec![robot::run(experiment, form, only)]
    } else {
        (0..robots)
            .into_par_iter()
            .map(|number| robot::run(experiment, form, number))
            .collect()
    };
    Row {
        name: experiment.name.clone(),
        outcomes,
        bars: experiment.bars.clone(),
        document: experiment.document.clone(),
        beyond: experiment.beyond,
    }
}

/// The table of `rows`, held to the bars of each and of all together.
#[must_use]
pub(super) fn report(title: &str, rows: &[Row], pooled: &[Bar], chance: f64) -> Found {
    let mut table = Table::new([
        "robots that",
        "ok by 15, 20, 60 s, of",
        "median",
        "wrong of takeovers",
        "ok and wrong: robots, longest",
        "left ok",
        "named: honest, liar",
        "NEES; above 11.3, above 16.3",
        "prototype",
    ]);
    let mut missed = Vec::new();
    for row in rows {
        table.row(cells(row));
        let robots: Vec<_> = row.outcomes.iter().collect();
        let misses = row
            .bars
            .iter()
            .filter_map(|bar| bar.missed(&robots, chance));
        missed.extend(misses.map(|it| format!("{}: {it}", row.name)));
    }
    let counted = rows.iter().filter(|row| !row.beyond);
    let all: Vec<_> = counted.flat_map(|row| &row.outcomes).collect();
    let misses = pooled.iter().filter_map(|bar| bar.missed(&all, chance));
    missed.extend(misses.map(|it| format!("all together: {it}")));
    let honesty = Honesty::of(all.iter().copied());
    let (known, missed) = missed.into_iter().partition(|it| is_known(it));
    Found {
        title: title.into(),
        text: format!(
            "{}\nNEES of {} robots together, but for rows with a star: {}.\n",
            table.text(),
            all.len(),
            honesty.text()
        ),
        missed,
        known,
        honesty,
    }
}

fn cells(row: &Row) -> [String; 9] {
    let robots = &row.outcomes;
    let by = |limit: f64| {
        let found = robots.iter().filter_map(|it| it.found_s);
        found.filter(|found| *found <= limit).count()
    };
    let sum = |of: fn(&Outcome) -> u32| robots.iter().map(of).sum::<u32>();
    let most = |of: fn(&Outcome) -> f64| robots.iter().map(of).fold(0.0, f64::max);
    let not_ok_s: f64 = robots.iter().map(|it| it.not_ok_s).sum();
    let share = |of: fn(&Outcome) -> bool| robots.iter().filter(|it| of(it)).count();
    [
        format!("{}{}", row.name, if row.beyond { " *" } else { "" }),
        format!(
            "{}, {}, {} of {}",
            by(15.0),
            by(20.0),
            by(60.0),
            robots.len()
        ),
        seconds(median(robots.iter().map(|it| it.found_s))),
        format!("{} of {}", sum(|it| it.wrongly), sum(|it| it.followed)),
        format!(
            "{}, {:.1} s",
            share(|it| it.wrong_s > 0.0),
            most(|it| it.wrong_longest_s)
        ),
        format!("{} times, {:.0} s", sum(|it| it.alarms), not_ok_s),
        format!(
            "{}, {}",
            sum(|it| it.honest_named),
            share(|it| it.liar_at_end)
        ),
        Honesty::of(robots).text(),
        row.document.clone(),
    ]
}
