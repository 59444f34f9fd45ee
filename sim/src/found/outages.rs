//! Outages: a robot drives without fixes, and after each of several times it is tried what comes of fixes then.

use rayon::prelude::*;

use super::Form;
use super::experiment::{Drive, Experiment, Sensor, Wheels};
use super::outcome::Outcome;
use super::report::Row;
use super::robot::{COARSE, Pace, Robot};
use super::world::ticks;

/// Fixes before the outage \[s\].
const BEFORE_S: f64 = 20.0;

/// Until the fixes come back \[s\].
const OUTAGES_S: [u32; 5] = [30, 90, 200, 600, 1800];

const FIXES: [Sensor; 4] = [
    Sensor::fix(0.05),
    Sensor::fix(1.0),
    Sensor::fix(0.05).at_hz(1),
    Sensor::fix(1.0).at_hz(1),
];

const ROBOTS: usize = 4000;

/// A robot for each noise and each way; all outages and all fixes are tried with the same one.
fn experiments() -> Vec<Experiment> {
    let of = |name: &str, wheels, drive| Experiment {
        wheels,
        drive,
        ..Experiment::new(name, ROBOTS)
    };
    vec![
        of("sane, at random", Wheels::Sane, Drive::Wander(1.0)),
        of("sane, straight", Wheels::Sane, Drive::Straight(1.0)),
        of("paper, at random", Wheels::Paper, Drive::Wander(1.0)),
        of("paper, straight", Wheels::Paper, Drive::Straight(1.0)),
    ]
}

/// A row for each noise, way and outage, of all kinds of fixes.
pub(super) fn rows(form: &Form) -> Vec<Row> {
    let wanted = experiments().into_iter().filter(|it| form.wants(&it.name));
    wanted.flat_map(|it| rows_of(&it, form)).collect()
}

fn rows_of(experiment: &Experiment, form: &Form) -> Vec<Row> {
    let robots: Vec<_> = match form.robot {
        Some(only) => vec![outages(experiment, form, only)],
        None => (0..form.robots(experiment.robots))
            .into_par_iter()
            .map(|number| outages(experiment, form, number))
            .collect(),
    };
    let row = |(at, outage): (usize, &u32)| Row {
        name: format!("{}, {outage} s", experiment.name),
        outcomes: robots.iter().flat_map(|it| it[at].clone()).collect(),
        bars: Vec::new(),
        document: String::new(),
        beyond: false,
    };
    OUTAGES_S.iter().enumerate().map(row).collect()
}

/// For each outage, what came of each kind of fixes.
fn outages(experiment: &Experiment, form: &Form, number: usize) -> [[Outcome; 4]; 5] {
    let mut robot = Robot::new(experiment, form, number);
    robot.pass(ticks(BEFORE_S), form.stride);
    let begins = robot.now();
    robot.silence(u32::MAX);
    OUTAGES_S.map(|outage| {
        // The wheels alone: at 10 Hz, because only the way counts.
        robot.pass(begins + ticks(f64::from(outage)) - COARSE, COARSE);
        FIXES.map(|fixes| {
            let mut robot = robot.clone();
            robot.hear(&[fixes]);
            robot.silence(0);
            let now = robot.now();
            robot.watched(experiment, now, Pace::easing(form))
        })
    })
}
