//! Velocities of the body, of robots that measure those.

use crate::config_error::ConfigError;

use super::super::config::{BodyConfig, BodySignal};
use super::super::kinematics::Kinematics;
use super::super::unit::Meaning;
use super::planner::{Planner, Role};
use super::source::Source;
use super::{meaning, scale};

/// The body's own velocities.
pub(super) fn plan<'a>(
    planner: &mut Planner<'a>,
    body: &'a BodyConfig,
) -> Result<Kinematics, ConfigError> {
    let (max_speed, max_turn) = (
        planner.config.max_speed_mps,
        planner.config.max_turn_rate_radps,
    );
    let forward = (scale::of_speed(&body.forward), max_speed, "m/s");
    velocity(planner, "body.forward", &body.forward, forward)?;
    let turn = (scale::of_turn(&body.turn), max_turn, "rad/s");
    velocity(planner, "body.turn", &body.turn, turn)?;
    if let Some(sideways) = &body.sideways {
        let speed = (scale::of_speed(sideways), max_speed, "m/s");
        velocity(planner, "body.sideways", sideways, speed)?;
    }
    planner.description.geometry = if body.sideways.is_some() {
        "velocities of the body: forward, sideways and turning".into()
    } else {
        "velocities of the body: forward and turning; it does not move sideways".into()
    };
    Ok(Kinematics::Body)
}

/// `unit` is what one unit of the signal is worth, the most that is plausible, and the name of both.
fn velocity<'a, U: Default + Meaning>(
    planner: &mut Planner<'a>,
    setting: &'a str,
    signal: &'a BodySignal<U>,
    (scale, limit, unit): (f64, f64, &str),
) -> Result<(), ConfigError> {
    let source = Source {
        setting,
        bus: signal.bus,
        message: &signal.message,
        signal: &signal.signal,
    };
    let found = planner.find(&source)?;
    found.agree(&source, "unit", signal.unit)?;
    planner
        .description
        .warn(found.unknown_unit(&source, "unit", signal.unit));
    let role = Role {
        meaning: meaning::of_body(signal.unit.word(), scale, unit, signal.reversed),
        ..planner.rate(&source, &found, scale, limit, None)?
    };
    planner.add(&source, &found, role)
}
