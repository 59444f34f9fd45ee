//! From what a person wrote to what the decoder runs: every name looked up, every number checked.

mod axle;
mod body;
mod counts;
mod meaning;
mod period;
mod planner;
mod proof;
mod reach;
mod scale;
mod source;
mod unlikely;

use crate::config_error::ConfigError;
use crate::database::Database;

use super::config::OdometryConfig;
use super::description::Description;
use super::merge::Merge;
use super::message::Message;
use planner::Planner;
pub(super) use scale::positive;

/// Everything that a decoder needs.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) messages: Vec<Message>,
    pub(super) merge: Merge,
    description: Description,
}

/// Says what a decoder of this configuration will read.
///
/// # Errors
/// [`ConfigError`], as [`super::OdometryDecoder::new`].
pub fn describe(config: &OdometryConfig) -> Result<Description, ConfigError> {
    plan(config).map(|plan| plan.description)
}

/// What is possible and unlikely in this configuration; each begins with its setting, or with the message that it is about.
///
/// # Errors
/// [`ConfigError`], as [`describe`].
pub fn warnings(config: &OdometryConfig) -> Result<Vec<String>, ConfigError> {
    if config.is_on_can() {
        describe(config).map(|description| description.warnings)
    } else {
        Ok(unlikely::of_robot(config))
    }
}

/// Compiles the configuration.
pub(super) fn plan(config: &OdometryConfig) -> Result<Plan, ConfigError> {
    check_buses(config)?;
    positive("max_speed_mps", config.max_speed_mps)?;
    positive("max_turn_rate_radps", config.max_turn_rate_radps)?;
    let database = Database::load(config.dbc.as_deref())?;
    let mut planner = Planner::new(config, &database)?;
    let kinematics = match (&config.wheels, &config.body) {
        (Some(wheels), None) => axle::plan(&mut planner, wheels)?,
        (None, Some(body)) => body::plan(&mut planner, body)?,
        _ => {
            return Err(ConfigError::setting(
                "wheels",
                "give either [odometry.wheels] or [odometry.body], one of the two; where [odometry.base] alone is heard, leave \
                 out buses",
            ));
        }
    };
    let (messages, channels, description) = planner.finish();
    Ok(Plan {
        messages,
        merge: Merge::new(channels, kinematics, config.tolerance),
        description,
    })
}

fn check_buses(config: &OdometryConfig) -> Result<(), ConfigError> {
    if (1..=256).contains(&config.buses.len()) {
        return Ok(());
    }
    Err(ConfigError::setting(
        "buses",
        "give at least one bus, for example [\"socketcan:can0\"]; or [odometry.base], for a base that does not speak CAN",
    ))
}
