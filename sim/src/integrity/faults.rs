//! One source lies at a time, from one slot on.

use coloc_bounds::monitor::{Monitor, Standing};
use coloc_bounds::slot::Suspect;
use rayon::prelude::*;

use super::Form;
use super::bar::{Bars, found, quantile, wilson};
use super::setting::{SLOT_S, Setting};
use super::slots::{Drive, Fault, Lie, Source, direction, margin};
use crate::campaign::Finding;
use crate::honest::table::{Table, percent};
use crate::method::Kind;
use crate::mrclam::GridWorld;
use crate::random::Noise;

/// It is looked for that long \[slots\].
pub(super) const PATIENCE: usize = 60;
/// The specification's share that is named alone.
const NAMED: f64 = 0.9;

/// A kind of fault.
#[derive(Copy, Clone, Debug)]
pub(super) struct Kinds {
    pub(super) name: &'static str,
    pub(super) source: Source,
    pub(super) lie: Lie,
}

/// Those that begin at once.
const KINDS: [Kinds; 11] = [
    kind("fix of R1, 3 m", Source::Fix(0), 3.0),
    kind("fix of R2, 3 m", Source::Fix(1), 3.0),
    kind("fix of R1, 1 m", Source::Fix(0), 1.0),
    kind("sightings of R3, 1 m", Source::Sightings(2), 1.0),
    kind("sightings of R1, 1 m", Source::Sightings(0), 1.0),
    kind("sightings of R3, 0.5 m", Source::Sightings(2), 0.5),
    kind("fix of R1, 0.5 m", Source::Fix(0), 0.5),
    other("fix of R1 is stuck", Source::Fix(0), Lie::Stuck),
    other(
        "sightings of R3 are stuck",
        Source::Sightings(2),
        Lie::Stuck,
    ),
    other(
        "R3 takes who it sees for another",
        Source::Sightings(2),
        Lie::Mistaken,
    ),
    other("wheels of R3 are stuck", Source::Wheels(2), Lie::Stuck),
];

/// So many of them are held to the bar.
const BARRED: usize = 2;

const fn kind(name: &'static str, source: Source, metres: f64) -> Kinds {
    let lie = Lie::Off { metres, drift: 0.0 };
    other(name, source, lie)
}

const fn other(name: &'static str, source: Source, lie: Lie) -> Kinds {
    Kinds { name, source, lie }
}

/// What came of one fault.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Slots until something did not fit, that one included.
    pub(super) alarm: Option<usize>,
    /// Who was named then.
    pub(super) suspects: Vec<Suspect>,
    /// Slots until the truth of any robot was outside.
    pub(super) lost: Option<usize>,
}

/// A fault that begins at slot `first`, where `monitor` was.
pub(super) fn follow(drive: &Drive, mut monitor: Monitor, first: usize, fault: &Fault) -> Found {
    let mut found = Found {
        alarm: None,
        suspects: Vec::new(),
        lost: None,
    };
    let last = (first + PATIENCE).min(drive.slots.len());
    for number in first..last {
        let since = number - first;
        let outcome = drive.close(&mut monitor, number, Some((fault, since)));
        if outcome.standing == Standing::Violated {
            found.alarm = Some(since + 1);
            found.suspects = outcome.suspects;
            return found;
        }
        let truth = drive.slots[number].truth.iter().enumerate();
        let is_lost = truth
            .filter_map(|(robot, truth)| truth.as_ref().map(|it| (robot, [it.x, it.y])))
            .any(|(robot, at)| margin(&monitor, robot, at) < 0.0);
        if is_lost && found.lost.is_none() {
            found.lost = Some(since + 1);
        }
    }
    found
}

/// Whether exactly who lies was named.
fn is_named(found: &Found, source: Source) -> bool {
    match source {
        Source::Fix(robot) => found.suspects == [Suspect::Fix(robot)],
        Source::Sightings(robot) => {
            let is_his = |it: &Suspect| matches!(it, Suspect::Sightings(of) | Suspect::Sighting(of, _) if *of == robot);
            found.suspects.len() == 1 && found.suspects.iter().all(is_his)
        }
        Source::Wheels(robot) => found.suspects == [Suspect::Motion(robot)],
    }
}

/// Faults of each kind in a run, one every so many slots, each on a monitor that was honest before.
pub(super) fn runs(
    form: &Form,
    world: &GridWorld,
    setting: Setting,
    kinds: &[Kinds],
) -> Vec<Vec<Found>> {
    let noise = Noise::new(form.seed, 0);
    let drive = Drive::new(world, setting, Kind::Sl, [form.seed, 0], form.slots);
    let mut monitor = drive.monitor();
    let mut begun = Vec::new();
    let last = drive.slots.len().saturating_sub(PATIENCE);
    let every = form.every(last);
    for number in 0..last {
        if number % every == every / 2 {
            begun.push((number, monitor.clone()));
        }
        drive.close(&mut monitor, number, None);
    }
    let of = |(place, kind): (usize, &Kinds)| {
        let of_one = |(number, monitor): &(usize, Monitor)| {
            let fault = Fault {
                source: kind.source,
                direction_rad: direction(&noise, *number, 10 + place),
                lie: kind.lie,
            };
            follow(&drive, monitor.clone(), *number, &fault)
        };
        // What says nothing cannot lie.
        let speaks = begun.par_iter().filter(|it| drive.says(it.0, kind.source));
        speaks.map(of_one).collect()
    };
    kinds.par_iter().enumerate().map(of).collect()
}

/// The median and the largest time to the alarm of those that were found.
#[allow(clippy::cast_precision_loss)] // Slots.
pub(super) fn times(found: &[Found]) -> String {
    let alarms = found.iter().filter_map(|it| it.alarm);
    let mut times: Vec<_> = alarms.map(|it| it as f64 * SLOT_S).collect();
    let [middle, late, most] = [0.5, 0.9, 1.0].map(|it| quantile(&mut times, it));
    format!("{middle:.1} / {late:.1} / {most:.1}")
}

/// What is found.
#[must_use]
#[allow(clippy::cast_precision_loss)] // Hundreds.
pub fn find(form: &Form) -> Finding {
    found("One source lies by a constant", form, |worlds, bars| {
        let mut table = Table::new([
            "MR.CLAM",
            "who lies",
            "times",
            "found in the first slot",
            "within two",
            "within 30 s",
            "time to the alarm, s (median / 90 % / most)",
            "named alone",
            "truth outside before the alarm",
        ]);
        let mut lines = Bars::default();
        for (number, world) in worlds {
            let all = runs(form, world, Setting::HARD, &KINDS);
            for (place, (kind, found)) in KINDS.iter().zip(&all).enumerate() {
                let within = |slots: usize| {
                    let is_in = |it: &&Found| it.alarm.is_some_and(|it| it <= slots);
                    found.iter().filter(is_in).count()
                };
                let named = found.iter().filter(|it| is_named(it, kind.source)).count();
                let lost = found.iter().filter(|it| it.lost.is_some()).count();
                let begun = found.len();
                let share = |it: usize| percent(it as f64 / begun.max(1) as f64);
                table.row([
                    number.to_string(),
                    kind.name.into(),
                    begun.to_string(),
                    share(within(1)),
                    share(within(2)),
                    share(within(PATIENCE)),
                    times(found),
                    share(named),
                    lost.to_string(),
                ]);
                if place < BARRED {
                    let low = wilson(named, begun)[0];
                    lines.hold(
                            within(2) == begun && low >= NAMED,
                            &format!(
                                "MR.CLAM {number}: {}: {} of {begun} found within two slots (all), {named} named alone, lower bound {:.1} % (90 %)",
                                kind.name,
                                within(2),
                                100.0 * low
                            ),
                        );
                }
            }
        }
        bars.table(&table.text());
        bars.append(lines);
    })
}
