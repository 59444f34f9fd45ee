//! The yaw rate of a gyro that speaks CAN.

use crate::config_error::ConfigError;
use crate::database::Database;

use super::super::config::{BodySignal, MessageConfig, OdometryConfig, TurnUnit};
use super::super::gyro::GyroDecoder;
use super::source::{Found, Source};
use super::{positive, proof, scale};

/// The decoder of `signal` on the buses of `config`, by its DBC file.
pub(in super::super) fn plan(
    config: &OdometryConfig,
    signal: &BodySignal<TurnUnit>,
) -> Result<GyroDecoder, ConfigError> {
    let limit = positive("max_turn_rate_radps", config.max_turn_rate_radps)?;
    let database = Database::load(config.dbc.as_deref())?;
    let source = Source {
        setting: "signal",
        bus: signal.bus,
        message: &signal.message,
        signal: &signal.signal,
    };
    let found = Found::look_up(&source, &database, config.buses.len())?;
    found.agree(&source, "unit", signal.unit)?;
    let mut proofs = config.messages.clone();
    if config.dbc.is_none() {
        proofs.extend(MessageConfig::coloc());
    }
    let proof = proof::of(&database, &proofs, found.message, &found.decoder)?;
    Ok(GyroDecoder::new(
        (signal.bus, found.id),
        found.decoder,
        proof.guard,
        (scale::of_turn(signal), limit),
    ))
}
