//! Gates that let everything pass or hardly anything, and settings without effect.

use std::f64::consts::TAU;

use coloc_drivers::encoder::Rounded;

use super::super::finding::Finding;
use super::super::{Config, Fusion};

/// Half of all honest inputs have a larger d²: χ² with 3, with 2 and with one degree of freedom.
const MEDIAN_OF_3: f64 = 2.366;
const MEDIAN_OF_2: f64 = 1.386;
const MEDIAN_OF_1: f64 = 0.455;

/// Ten σ: no honest input is so far off.
const OPEN: f64 = 100.0;

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let fusion = &config.fusion;
    let gates = [
        gate("neighbour_gate", fusion.neighbour_gate, MEDIAN_OF_3),
        gate("position_gate", fusion.position_gate, MEDIAN_OF_2),
        gate("heading_gate", fusion.heading_gate, MEDIAN_OF_1),
    ];
    let floors = [
        floor("relative_pose_floor", fusion.relative_pose_floor),
        floor("neighbour_floor", fusion.neighbour_floor),
    ];
    let places = [
        far("relative_pose_floor", &fusion.relative_pose_floor[..2]),
        far("neighbour_floor", &fusion.neighbour_floor[..2]),
        far("position_floor", &fusion.position_floor),
    ];
    gates
        .into_iter()
        .chain(floors)
        .chain(places)
        .flatten()
        .chain(overridden(fusion))
        .collect()
}

fn gate(key: &str, gate: f64, median: f64) -> Option<Finding> {
    let problem = match gate {
        gate if gate == f64::INFINITY => {
            " = inf: accepts everything, also what is a kilometre off".to_owned()
        }
        gate if gate > OPEN => {
            format!(
                " = {gate}: accepts what is {} σ off; it is a square",
                Rounded(gate.sqrt())
            )
        }
        gate if gate < median => {
            format!(
                " = {gate}: refuses more than half of all honest inputs; 99 % of them pass at the default"
            )
        }
        _ => return None,
    };
    Some(Finding::new(format!("fusion.{key}"), problem))
}

fn floor(key: &str, floor: [f64; 3]) -> Option<Finding> {
    let heading = floor[2];
    let problem = format!(
        ".2 = {heading}: {heading} rad are more than a turn: are these degrees? {heading}° are {} rad",
        Rounded(heading.to_radians())
    );
    (heading > TAU).then(|| Finding::new(format!("fusion.{key}"), problem))
}

/// A sensor of places that knows them no better is none \[m\].
const USELESS_M: f64 = 100.0;

fn far(key: &str, floor: &[f64]) -> Option<Finding> {
    let (axis, floor) = floor.iter().enumerate().find(|(_, it)| **it > USELESS_M)?;
    let problem = format!(
        ".{axis} = {floor}: no such input is taken for more certain than {floor} m: is it in metres?"
    );
    Some(Finding::new(format!("fusion.{key}"), problem))
}

/// What `paper` overrides.
fn overridden(fusion: &Fusion) -> Option<Finding> {
    let usual = Fusion::default();
    let same = Fusion {
        mode: usual.mode,
        paper: usual.paper,
        criterion: fusion.criterion,
        neighbour_gate: fusion.neighbour_gate,
        position_gate: fusion.position_gate,
        heading_gate: fusion.heading_gate,
        relative_pose_floor: fusion.relative_pose_floor,
        neighbour_floor: fusion.neighbour_floor,
        position_floor: fusion.position_floor,
        heading_floor: fusion.heading_floor,
        ..usual
    };
    let problem = " = true: overrides heading_lever_m, damping, memory_s, reset_on_transmit, gate_weight and propagation, of \
                   which some are set here";
    let otherwise = Fusion {
        paper: false,
        ..fusion.clone()
    };
    (fusion.paper && otherwise != same).then(|| Finding::new("fusion.paper", problem))
}
