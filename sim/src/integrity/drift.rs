//! A fix that goes away slowly: the region is dragged along, until something does not fit.

use super::Form;
use super::bar::{Bars, found, quantile};
use super::faults::{Found, Kinds, runs, times};
use super::setting::{SLOT_S, Setting};
use super::slots::{Lie, Source};
use crate::campaign::Finding;
use crate::honest::table::{Table, percent};

const KINDS: [Kinds; 4] = [
    kind("fix of R1, 0.05 m/s", 0, 0.05),
    kind("fix of R2, 0.05 m/s", 1, 0.05),
    kind("fix of R1, 0.2 m/s", 0, 0.2),
    kind("fix of R1, 0.02 m/s", 0, 0.02),
];

/// So many of them are the specification's.
const OF_SPECIFICATION: usize = 2;

const fn kind(name: &'static str, robot: usize, drift: f64) -> Kinds {
    Kinds {
        name,
        source: Source::Fix(robot),
        lie: Lie::Off { metres: 0.0, drift },
    }
}

/// Half of the middle of what the specification measured, 12 to 17 s, at 0.05 m/s.
const BAR_S: f64 = 7.5;

/// Until the alarm \[s\].
#[allow(clippy::cast_precision_loss)] // Slots.
fn median_s(found: &[Found]) -> f64 {
    let alarms = found.iter().filter_map(|it| it.alarm);
    let mut times: Vec<_> = alarms.map(|it| it as f64 * SLOT_S).collect();
    quantile(&mut times, 0.5)
}

/// Slots until the truth was outside \[s\].
#[allow(clippy::cast_precision_loss)] // Slots.
fn lost_s(found: &[Found]) -> f64 {
    let lost = found.iter().filter_map(|it| it.lost);
    let mut times: Vec<_> = lost.map(|it| it as f64 * SLOT_S).collect();
    quantile(&mut times, 0.5)
}

/// Each of the one with each of the other.
fn pairs<'a, A, B>(first: &'a [A], second: &'a [B]) -> impl Iterator<Item = (&'a A, &'a B)> {
    first
        .iter()
        .flat_map(move |a| second.iter().map(move |b| (a, b)))
}

/// What is found.
#[must_use]
#[allow(clippy::cast_precision_loss)] // Hundreds.
pub fn find(form: &Form) -> Finding {
    found("A fix that goes away slowly", form, |worlds, bars| {
        let mut table = Table::new([
            "MR.CLAM",
            "who lies",
            "means promised",
            "times",
            "found within 30 s",
            "time to the alarm, s (median / 90 % / most)",
            "truth outside before the alarm",
            "first so after, s (median)",
        ]);
        let mut lines = Bars::default();
        let settings = [("no", Setting::FORGETFUL), ("yes", Setting::HARD)];
        for ((number, world), (word, setting)) in pairs(worlds, &settings) {
            let found = runs(form, world, *setting, &KINDS);
            for (place, (kind, found)) in KINDS.iter().zip(found).enumerate() {
                let alarms = found.iter().filter(|it| it.alarm.is_some()).count();
                let lost = found.iter().filter(|it| it.lost.is_some()).count();
                let share = |it: usize| percent(it as f64 / found.len().max(1) as f64);
                if place < OF_SPECIFICATION && setting.means.fixes < 1.0 {
                    let middle = median_s(&found);
                    lines.hold(
                        alarms == found.len() && middle <= BAR_S,
                        &format!("MR.CLAM {number}: {}: {alarms} of {} found, the median after {middle} s (half of the specification's 12 to 17 s: {BAR_S} s)", kind.name, found.len()),
                    );
                }
                table.row([
                    number.to_string(),
                    kind.name.into(),
                    (*word).into(),
                    found.len().to_string(),
                    share(alarms),
                    times(&found),
                    share(lost),
                    format!("{:.1}", lost_s(&found)),
                ]);
            }
        }
        bars.table(&table.text());
        bars.append(lines);
    })
}
