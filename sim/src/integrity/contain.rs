//! Honest robots whose errors are within their bounds: is the truth inside, and does anybody cry wolf?

use std::fmt::Write as _;

use coloc_bounds::evidence::Area;
use coloc_bounds::monitor::{Contained, Judge, Standing, distance};
use coloc_bounds::slot::Suspect;
use coloc_bounds::{Limits, Polytope, Projection, Sandwich, Tolerance};
use rayon::prelude::*;

use super::Form;
use super::bar::{Bars, found, quantile, wilson};
use super::setting::{SLOT_S, Setting};
use super::slots::{Drive, margin};
use crate::campaign::Finding;
use crate::honest::table::{Table, digits};
use crate::method::Kind;
use crate::mrclam::GridWorld;

/// The specification's median areas of R1, R2 and of the others \[m²\].
const AREAS_M2: [f64; 2] = [0.22, 0.93];
/// A fifth more is allowed.
const AREA_ROOM: f64 = 1.2;
/// The specification's share of all below 1.4 m².
const MOST_M2: f64 = 1.4;

/// What came of a run, or of several.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    pub(super) slots: usize,
    pub(super) truth_outside: usize,
    pub(super) heading_outside: usize,
    pub(super) violated: usize,
    pub(super) starting: usize,
    /// Robots' slots in which the estimate was outside.
    pub(super) single: usize,
    pub(super) alarms: usize,
    /// Of those that are proven another way: see [`is_proven`].
    pub(super) proven: usize,
    /// How far from the truth the estimate was at each alarm \[m\].
    pub(super) off_m: Vec<f64>,
    /// Slots that did not fit.
    pub(super) misfits: Vec<Misfit>,
    pub(super) open: usize,
    pub(super) least_margin: f64,
    pub(super) areas: Vec<Vec<f64>>,
    pub(super) headings: Vec<Vec<f64>>,
}

/// A slot that did not fit, though everybody is honest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Misfit {
    /// Since the recording began \[s\].
    pub(super) seconds: f64,
    pub(super) suspects: Vec<Suspect>,
}

/// A line cuts `estimate` off from all places of `robot` that satisfy all rows, though not from where it truly is. Found by searches for the
/// region's corners, not by the program that judges estimates.
fn is_proven(believed: &Polytope, robot: usize, [estimate, truth]: [[f64; 2]; 2]) -> bool {
    let Ok(mut region) = believed.region() else {
        return false;
    };
    let mut search = |direction| region.support(Projection::Robot(robot), direction);
    let limits = Limits {
        ratio: 1.0,
        gap: 0.0,
        searches: 64,
    };
    let tolerance = Tolerance::of_programs(&believed.arena());
    Sandwich::approximate(&mut search, [1.0, 0.0], tolerance, limits)
        .is_some_and(|it| it.may_hold(truth) && !it.may_hold(estimate))
}

impl Tally {
    #[allow(clippy::cast_precision_loss)] // Slots.
    pub(super) fn of(drive: &Drive, robots: usize) -> Self {
        let mut monitor = drive.monitor();
        let mut tally = Self {
            least_margin: f64::INFINITY,
            areas: vec![Vec::new(); robots],
            headings: vec![Vec::new(); robots],
            ..Self::default()
        };
        let mut judges = vec![Judge::new(2, 5); robots];
        for (number, slot) in drive.slots.iter().enumerate() {
            let outcome = drive.close(&mut monitor, number, None);
            tally.slots += 1;
            tally.violated += usize::from(outcome.standing == Standing::Violated);
            tally.starting += usize::from(outcome.standing == Standing::Starting);
            if outcome.standing == Standing::Violated {
                tally.misfits.push(Misfit {
                    seconds: SLOT_S * (number + 1) as f64,
                    suspects: outcome.suspects.clone(),
                });
            }
            for (robot, judge) in judges.iter_mut().enumerate() {
                let is_open = monitor.is_open(robot);
                tally.open += usize::from(is_open);
                if let Some(truth) = slot.truth[robot] {
                    let inside = margin(&monitor, robot, [truth.x, truth.y]);
                    tally.least_margin = tally.least_margin.min(inside);
                    tally.truth_outside += usize::from(inside < 0.0);
                    let turned = monitor.team.headings[robot].contains(truth.phi, 0.0);
                    tally.heading_outside += usize::from(!turned);
                }
                // Where the recording has lost a robot nothing is measured of it, and its region grows.
                let polygon = slot.truth[robot].and(monitor.polygon(robot));
                if let Some(polygon) = polygon {
                    tally.areas[robot].push(coloc_bounds::polygon::area(&polygon));
                    tally.headings[robot].push(monitor.team.headings[robot].half);
                }
                let here = Area {
                    centre: slot.estimates[robot],
                    half: [0.0; 2],
                };
                let known = outcome.standing == Standing::Ok && !is_open;
                let far = known
                    .then(|| distance(&outcome.believed, robot, &here).ok())
                    .flatten();
                let is_outside = far.map(|it| it.at_least > 0.0);
                let before = *judge;
                let is_alarm = judge.judge(is_outside) == Contained::No;
                tally.single += usize::from(is_outside == Some(true));
                let is_new = is_alarm && !before.is_alarm();
                tally.alarms += usize::from(is_new);
                if let Some(truth) = slot.truth[robot].filter(|_| is_new) {
                    let at = [here.centre, [truth.x, truth.y]];
                    tally.proven += usize::from(is_proven(&outcome.believed, robot, at));
                    let [x, y] = [0, 1].map(|axis| at[0][axis] - at[1][axis]);
                    tally.off_m.push(x.hypot(y));
                }
            }
        }
        tally
    }

    fn plus(mut self, other: Self) -> Self {
        self.slots += other.slots;
        self.truth_outside += other.truth_outside;
        self.heading_outside += other.heading_outside;
        self.violated += other.violated;
        self.starting += other.starting;
        self.single += other.single;
        self.alarms += other.alarms;
        self.proven += other.proven;
        self.off_m.extend(other.off_m);
        self.misfits.extend(other.misfits);
        self.open += other.open;
        self.least_margin = self.least_margin.min(other.least_margin);
        for (all, more) in self.areas.iter_mut().zip(other.areas) {
            all.extend(more);
        }
        for (all, more) in self.headings.iter_mut().zip(other.headings) {
            all.extend(more);
        }
        self
    }
}

/// All runs of a recording, with the estimates of `kind`.
pub(super) fn runs(
    form: &Form,
    world: &GridWorld,
    (setting, kind): (Setting, Kind),
    runs: u16,
) -> Tally {
    use crate::world::World as _;
    let robots = world.robots();
    let of = |run: u16| {
        let seed = [form.seed, u64::from(run)];
        let drive = Drive::new(world, setting, kind, seed, form.slots);
        Tally::of(&drive, robots)
    };
    let all = (0..runs).into_par_iter().map(of).collect::<Vec<_>>();
    all.into_iter().reduce(Tally::plus).unwrap_or_default()
}

/// In a row of a table: recording, slots, truth outside, headings outside, least margin, areas, the largest 1 %, violated.
pub(super) fn row(number: u32, tally: &mut Tally) -> [String; 9] {
    let medians: Vec<_> = tally
        .areas
        .iter_mut()
        .map(|it| digits(quantile(it, 0.5)))
        .collect();
    let mut headings: Vec<_> = tally.headings.iter().flatten().copied().collect();
    let mut areas: Vec<_> = tally.areas.iter().flatten().copied().collect();
    [
        number.to_string(),
        tally.slots.to_string(),
        tally.truth_outside.to_string(),
        tally.heading_outside.to_string(),
        format!("{:.2} mm", 1e3 * tally.least_margin),
        medians.join(" "),
        digits(quantile(&mut areas, 0.99)),
        format!("{:.1}°", quantile(&mut headings, 0.5).to_degrees()),
        format!("{} / {} / {}", tally.violated, tally.single, tally.alarms),
    ]
}

pub(super) const HEAD: [&str; 9] = [
    "MR.CLAM",
    "slots",
    "truth outside",
    "heading outside",
    "least margin",
    "median area of R1 … R5, m²",
    "99 % below, m²",
    "median heading ±",
    "slots violated / estimate outside / alarms",
];

/// What is found.
#[must_use]
pub fn find(form: &Form) -> Finding {
    found(
        "Honest robots, errors within their bounds",
        form,
        |worlds, bars| {
            let mut table = Table::new(HEAD);
            let tallies: Vec<_> = worlds
                .iter()
                .map(|(number, world)| {
                    (
                        *number,
                        runs(form, world, (Setting::FORGETFUL, Kind::Coloc), form.runs),
                    )
                })
                .collect();
            let mut judged = Vec::new();
            let mut slots = 0;
            for (number, mut tally) in tallies {
                table.row(row(number, &mut tally));
                slots += tally.slots;
                judged.push((number, tally));
            }
            bars.table(&table.text());
            for (number, tally) in &mut judged {
                judge(*number, tally, bars);
            }
            let violated: usize = judged.iter().map(|it| it.1.violated).sum();
            bars.hold(
                violated == 0,
                &format!(
                    "{violated} of {slots} honest slots of the team violated (0; {:.4} % at most)",
                    100.0 * wilson(violated, slots)[1]
                ),
            );
        },
    )
}

/// The same where means are promised too: errors that are independent keep that promise, but for once in a long while.
#[must_use]
#[allow(clippy::cast_precision_loss)] // Thousands.
pub fn promised(form: &Form) -> Finding {
    found(
        "Honest robots, and means are promised",
        form,
        |worlds, bars| {
            let mut table = Table::new(HEAD);
            let mut lines = Bars::default();
            let mut misfits = String::new();
            let (mut violated, mut slots) = (0, 0);
            for (number, world) in worlds {
                let mut tally = runs(form, world, (Setting::HARD, Kind::Coloc), form.runs);
                table.row(row(*number, &mut tally));
                violated += tally.violated;
                slots += tally.slots;
                for it in &tally.misfits {
                    let _ = writeln!(
                        misfits,
                        "* MR.CLAM {number} after {} s: {:?}", // A string takes all.
                        it.seconds, it.suspects
                    );
                }
                judge_truth(*number, &tally, &mut lines);
            }
            bars.table(&table.text());
            let most = 100.0 * wilson(violated, slots)[1];
            bars.table(&format!("{violated} of {slots} honest slots of the team did not keep the promise: {most:.3} % at most."));
            bars.table(&misfits);
            bars.append(lines);
        },
    )
}

fn judge_truth(number: u32, tally: &Tally, bars: &mut Bars) {
    bars.hold(
        tally.truth_outside == 0 && tally.heading_outside == 0,
        &format!(
            "MR.CLAM {number}: truth outside in {} slots of a robot, heading in {} (0)",
            tally.truth_outside, tally.heading_outside
        ),
    );
}

fn judge(number: u32, tally: &mut Tally, bars: &mut Bars) {
    judge_truth(number, tally, bars);
    for (robot, areas) in tally.areas.iter_mut().enumerate() {
        let document = AREAS_M2[usize::from(robot > 1)];
        let median = quantile(areas, 0.5);
        bars.hold(
            median <= AREA_ROOM * document,
            &format!(
                "MR.CLAM {number}: R{} has {median:.3} m² in the median (specification {document}, a fifth more at most)",
                robot + 1
            ),
        );
    }
    let mut all: Vec<_> = tally.areas.iter().flatten().copied().collect();
    let most = quantile(&mut all, 0.99);
    bars.hold(
        most <= AREA_ROOM * MOST_M2,
        &format!("MR.CLAM {number}: 99 % of the areas are below {most:.2} m² (specification {MOST_M2}, a fifth more at most)"),
    );
    let far = quantile(&mut tally.off_m, 0.0);
    bars.hold(
        tally.proven == tally.alarms,
        &format!(
            "MR.CLAM {number}: {} of {} alarms of honest estimates are proven: a line cuts the estimate off from all that fits, not the truth (all); the estimate was off by {far:.2} m or more",
            tally.proven, tally.alarms
        ),
    );
}
