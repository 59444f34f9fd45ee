//! Tables of what came of it.

use rayon::prelude::*;

use super::Form;
use super::bar::{Bar, Honesty, median, seconds};
use super::experiment::Experiment;
use super::outcome::Outcome;
use super::robot;
use crate::honest::table::Table;

/// The robots of a row.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) name: String,
    pub(super) outcomes: Vec<Outcome>,
    pub(super) bars: Vec<Bar>,
    pub(super) document: &'static str,
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
        document: experiment.document,
    }
}

/// The table of `rows`, held to the bars of each and of all together.
#[must_use]
pub(super) fn report(title: &str, rows: &[Row], pooled: &[Bar]) -> Found {
    let mut table = Table::new([
        "robots that",
        "ok by 15, 20, 60 s, of",
        "median",
        "wrong of takeovers",
        "ok and wrong: robots; longest, all",
        "not held",
        "left ok",
        "NEES",
        "document",
    ]);
    let mut missed = Vec::new();
    for row in rows {
        if std::env::var_os("MOMENTS").is_some() {
            for m in 0..8 {
                let v: Vec<f64> = row.outcomes.iter().filter_map(|it| it.nees[m]).collect();
                let n = v.len();
                eprintln!("{} moment {m}: n {n} mean {:.3} >11 {} >16 {} >30 {}", row.name, v.iter().sum::<f64>() / n as f64, v.iter().filter(|x| **x > 11.345).count(), v.iter().filter(|x| **x > 16.27).count(), v.iter().filter(|x| **x > 30.66).count());
            }
        }
        table.row(cells(row));
        let robots: Vec<_> = row.outcomes.iter().collect();
        let misses = row.bars.iter().filter_map(|bar| bar.missed(&robots));
        missed.extend(misses.map(|it| format!("{}: {it}", row.name)));
    }
    let all: Vec<_> = rows.iter().flat_map(|row| &row.outcomes).collect();
    let misses = pooled.iter().filter_map(|bar| bar.missed(&all));
    missed.extend(misses.map(|it| format!("all together: {it}")));
    let honesty = Honesty::of(all.iter().copied());
    Found {
        title: title.into(),
        text: format!(
            "{}\nNEES of all {} robots together: {}.\n",
            table.text(),
            all.len(),
            honesty.text()
        ),
        missed,
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
    let share = |of: fn(&Outcome) -> bool| robots.iter().filter(|it| of(it)).count();
    [
        row.name.clone(),
        format!("{}, {}, {} of {}", by(15.0), by(20.0), by(60.0), robots.len()),
        seconds(median(robots.iter().map(|it| it.found_s))),
        format!("{} of {}", sum(|it| it.wrongly), sum(|it| it.followed)),
        format!(
            "{}; {:.1} s, {:.1} s",
            share(|it| it.wrong_s > 0.0),
            most(|it| it.wrong_longest_s),
            most(|it| it.wrong_s)
        ),
        format!("{}; {:.1} s", share(|it| it.uncovered_s > 0.0), most(|it| it.uncovered_s)),
        left_ok(robots),
        Honesty::of(robots).text(),
        row.document.into(),
    ]
}

/// How often, and for how long on the whole; who was named.
fn left_ok(robots: &[Outcome]) -> String {
    let alarms: u32 = robots.iter().map(|it| it.alarms).sum();
    let not_ok: f64 = robots.iter().map(|it| it.not_ok_s).sum();
    let named: u32 = robots.iter().map(|it| it.honest_named).sum();
    let liars = robots.iter().filter(|it| it.liar_at_end).count();
    let decided: Vec<_> = (0..5)
        .map(|kind| {
            let of = robots.iter().map(|it| it.decided[kind]);
            of.sum::<u32>().to_string()
        })
        .collect();
    format!(
        "{alarms}, {not_ok:.0} s; honest named {named}, liar {liars}; {}",
        decided.join("/")
    )
}
