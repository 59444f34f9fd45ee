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
        heading(config),
        position(config),
        nobody_tells(config),
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

fn heading(config: &Config) -> Option<Finding> {
    let pose = config.initial_pose()?;
    let heading = pose[2];
    let problem = format!(
        " = {}: a heading of {heading} rad is {} turns: are these degrees? {heading}° are {} rad",
        list(&pose),
        Rounded(heading / TAU),
        Rounded(heading.to_radians())
    );
    (heading.abs() > TAU).then(|| Finding::new("initial.pose", problem))
}

fn position(config: &Config) -> Option<Finding> {
    let pose = config.initial_pose()?;
    let [x, y, _] = pose;
    let problem = format!(
        " = {}: is farther from the origin than any place on Earth: is it in metres?",
        list(&pose)
    );
    (x.hypot(y) > FARTHEST_M).then(|| Finding::new("initial.pose", problem))
}

/// Fixes come by the channel `position` whether or not receivers are named; neighbours are.
fn nobody_tells(config: &Config) -> Option<Finding> {
    let unknown = config.initial_pose().is_none();
    let nobody = config.position.receivers == 0 && config.peers().next().is_none();
    let problem = " = \"unknown\": and neither [position] has receivers nor the team another robot: who will say where it is?";
    (unknown && nobody).then(|| Finding::new("initial.pose", problem))
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
