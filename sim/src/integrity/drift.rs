//! A fix that goes away slowly: the region is dragged along, until something does not fit.

use rayon::prelude::*;

use super::Form;
use super::bar::{found, quantile};
use super::faults::{Found, Kinds, PATIENCE, runs, times};
use super::setting::{SLOT_S, Setting};
use super::slots::{Drive, Source, direction};
use crate::campaign::Finding;
use crate::honest::table::{Table, percent};
use crate::method::Kind;
use crate::mrclam::GridWorld;
use crate::random::Noise;

const KINDS: [Kinds; 4] = [
    kind("fix of R1, 0.05 m/s", 0, 0.05),
    kind("fix of R2, 0.05 m/s", 1, 0.05),
    kind("fix of R1, 0.2 m/s", 0, 0.2),
    kind("fix of R1, 0.02 m/s", 0, 0.02),
];

const fn kind(name: &'static str, robot: usize, drift: f64) -> Kinds {
    Kinds {
        name,
        source: Source::Fix(robot),
        metres: 0.0,
        drift,
    }
}

/// Slots until the truth was outside \[s\].
#[allow(clippy::cast_precision_loss)] // Slots.
fn lost_s(found: &[Found]) -> f64 {
    let lost = found.iter().filter_map(|it| it.lost);
    let mut times: Vec<_> = lost.map(|it| it as f64 * SLOT_S).collect();
    quantile(&mut times, 0.5)
}

/// A fix less the middle of where all others have the robot, slot by slot \[m\].
fn separations(form: &Form, world: &GridWorld, run: u16, robot: usize) -> Vec<[f64; 2]> {
    let seed = [form.seed, u64::from(run)];
    let drive = Drive::new(world, Setting::HARD, Kind::Sl, seed, form.slots);
    let mut monitor = drive.monitor();
    let mut all = Vec::new();
    for number in 0..drive.slots.len() {
        let fix = drive.close_without_fix(&mut monitor, number, robot);
        let middle = monitor
            .polygon(robot)
            .and_then(|it| coloc_bounds::polygon::centroid(&it));
        if let (Some(fix), Some(middle)) = (fix, middle) {
            all.push([0, 1].map(|axis| fix.centre[axis] - middle[axis]));
        }
    }
    all
}

/// How far the mean of the last `window` values is from zero \[m\].
#[allow(clippy::cast_precision_loss)] // Dozens.
fn means(values: &[[f64; 2]], window: usize) -> impl Iterator<Item = f64> {
    values.windows(window).map(move |it| {
        let sum = it
            .iter()
            .fold([0.0; 2], |sum, it| [sum[0] + it[0], sum[1] + it[1]]);
        sum[0].hypot(sum[1]) / window as f64
    })
}

/// Slots from the beginning of a drift at `first` until the mean is beyond `limit`.
#[allow(clippy::cast_precision_loss)] // Slots.
fn found_after(
    values: &[[f64; 2]],
    (first, psi): (usize, f64),
    window: usize,
    limit: f64,
) -> Option<usize> {
    let from = first.saturating_sub(window - 1);
    let last = (first + PATIENCE).min(values.len());
    let drifting: Vec<_> = (from..last)
        .map(|number| {
            let off = 0.05 * SLOT_S * number.saturating_sub(first) as f64;
            [
                values[number][0] + off * psi.cos(),
                values[number][1] + off * psi.sin(),
            ]
        })
        .collect();
    let found = means(&drifting, window).position(|it| it > limit)?;
    Some((from + window + found).saturating_sub(first))
}

/// An idea that is not in the monitor: what a fix is off from all others is remembered for some slots. The limit is a quarter more than
/// the largest mean of an honest run; runs after that one say whether it is ever passed by honest fixes.
#[allow(clippy::cast_precision_loss)] // Slots.
fn remembered(form: &Form, worlds: &[(u32, GridWorld)]) -> String {
    let mut table = Table::new([
        "MR.CLAM",
        "who drifts, 0.05 m/s",
        "slots remembered",
        "limit, m",
        "honest slots beyond it",
        "found within 30 s",
        "time, s (median / 90 % / most)",
    ]);
    for (number, world) in worlds {
        for robot in [0, 1] {
            let runs: Vec<_> = (0..form.runs.clamp(2, 3))
                .into_par_iter()
                .map(|run| separations(form, world, run, robot))
                .collect();
            let (Some(first), Some(last)) = (runs.first(), runs.last()) else {
                continue;
            };
            for window in [1, 4, 8, 16] {
                let limit = 1.25 * means(first, window).fold(0.0, f64::max);
                let others = runs.iter().skip(1).map(|it| means(it, window));
                let beyond = others.flatten().filter(|it| *it > limit).count();
                let honest: usize = runs.iter().skip(1).map(Vec::len).sum();
                let noise = Noise::new(form.seed, 7);
                let begun = (16..last.len().saturating_sub(PATIENCE)).step_by(form.every);
                let times: Vec<_> = begun
                    .map(|it| found_after(last, (it, direction(&noise, it, robot)), window, limit))
                    .collect();
                let mut found: Vec<_> = times
                    .iter()
                    .flatten()
                    .map(|it| *it as f64 * SLOT_S)
                    .collect();
                let share = found.len() as f64 / times.len().max(1) as f64;
                let [middle, late, most] = [0.5, 0.9, 1.0].map(|it| quantile(&mut found, it));
                table.row([
                    number.to_string(),
                    format!("R{}", robot + 1),
                    window.to_string(),
                    format!("{limit:.2}"),
                    format!("{beyond} of {honest}"),
                    percent(share),
                    format!("{middle:.1} / {late:.1} / {most:.1}"),
                ]);
            }
        }
    }
    format!(
        "Not built in: the mean of some slots of what a fix is off from the middle of where all others have the robot.\n\n{}",
        table.text()
    )
}

/// What is found.
#[must_use]
#[allow(clippy::cast_precision_loss)] // Hundreds.
pub fn find(form: &Form) -> Finding {
    found("A fix that goes away slowly", form, |worlds, bars| {
        let mut table = Table::new([
            "MR.CLAM",
            "who lies",
            "times",
            "found within 30 s",
            "time to the alarm, s (median / 90 % / most)",
            "truth outside before the alarm",
            "first so after, s (median)",
        ]);
        let form = &Form {
            every: 3 * form.every,
            ..form.clone()
        };
        for (number, world) in worlds {
            for (kind, found) in KINDS.iter().zip(runs(form, world, 1, &KINDS)) {
                let alarms = found.iter().filter(|it| it.alarm.is_some()).count();
                let lost = found.iter().filter(|it| it.lost.is_some()).count();
                let share = |it: usize| percent(it as f64 / found.len().max(1) as f64);
                table.row([
                    number.to_string(),
                    kind.name.into(),
                    found.len().to_string(),
                    share(alarms),
                    times(&found),
                    share(lost),
                    format!("{:.1}", lost_s(&found)),
                ]);
            }
        }
        bars.table(&table.text());
        bars.table(&remembered(form, worlds));
    })
}
