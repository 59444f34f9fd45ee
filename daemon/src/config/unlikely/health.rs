//! Limits of what is fit to drive on that ask for nothing or for too much.

use std::f64::consts::PI;

use coloc_drivers::encoder::Rounded;

use super::super::Config;
use super::super::finding::Finding;

/// No robot on the ground knows better where it is \[m\].
const FINEST_M: f64 = 1e-3;

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    [
        position(config.health.fit_position_m),
        heading(config.health.fit_heading_rad),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn position(limit_m: f64) -> Option<Finding> {
    let problem = format!(
        " = {limit_m}: is less than a millimetre: the robot is never fit to drive on; is it in metres? 0 asks for nothing"
    );
    (limit_m > 0.0 && limit_m < FINEST_M).then(|| Finding::new("health.fit_position_m", problem))
}

fn heading(limit_rad: f64) -> Option<Finding> {
    let problem = format!(
        " = {limit_rad}: is half a turn or more: no heading is ever unfit; are these degrees? {limit_rad}° are {} rad",
        Rounded(limit_rad.to_radians())
    );
    (limit_rad >= PI).then(|| Finding::new("health.fit_heading_rad", problem))
}
