//! Who and where the robot is, and how it runs.

use std::f64::consts::TAU;

use coloc_drivers::encoder::Rounded;

use super::super::finding::Finding;
use super::super::{Config, Initial, Scheduler};
use super::list;

/// No place on Earth is farther from another \[m\].
const FARTHEST_M: f64 = 2.1e7;

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let initial = &config.initial;
    [
        number(config),
        heading(initial),
        position(initial),
        certain(initial),
        wide(initial),
        priority(config),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn number(config: &Config) -> Option<Finding> {
    let problem = " = 0: is also what a message says whose sender has set no number; count from 1";
    (config.robot.id == 0).then(|| Finding::new("robot.id", problem))
}

fn heading(initial: &Initial) -> Option<Finding> {
    let heading = initial.pose[2];
    let problem = format!(
        " = {}: a heading of {heading} rad is {} turns: are these degrees? {heading}° are {} rad",
        list(&initial.pose),
        Rounded(heading / TAU),
        Rounded(heading.to_radians())
    );
    (heading.abs() > TAU).then(|| Finding::new("initial.pose", problem))
}

fn position(initial: &Initial) -> Option<Finding> {
    let [x, y, _] = initial.pose;
    let problem = format!(
        " = {}: is farther from the origin than any place on Earth: is it in metres?",
        list(&initial.pose)
    );
    (x.hypot(y) > FARTHEST_M).then(|| Finding::new("initial.pose", problem))
}

fn certain(initial: &Initial) -> Option<Finding> {
    let problem = format!(
        " = {}: zero says that the robot starts exactly there; an input that does not agree is refused, or changes nothing",
        list(&initial.sigma)
    );
    initial
        .sigma
        .contains(&0.0)
        .then(|| Finding::new("initial.sigma", problem))
}

fn wide(initial: &Initial) -> Option<Finding> {
    let sigma = initial.sigma[2];
    let problem = format!(
        " = {}: {sigma} rad are more than a turn: are these degrees? {sigma}° are {} rad",
        list(&initial.sigma),
        Rounded(sigma.to_radians())
    );
    (sigma > TAU).then(|| Finding::new("initial.sigma", problem))
}

fn priority(config: &Config) -> Option<Finding> {
    let realtime = &config.realtime;
    let highest = realtime.scheduler != Scheduler::Other && realtime.priority == 99;
    let problem = " = 99: is the priority of the kernel's own watchdogs, which then have to wait; 98 is enough";
    highest.then(|| Finding::new("realtime.priority", problem))
}
