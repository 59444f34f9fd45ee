//! From what a person wrote to what the decoder runs: every name looked up, every number checked.

mod axle;
mod bicycle;
mod body;
mod counts;
mod gyro;
mod meaning;
mod period;
mod planner;
mod proof;
mod reach;
mod rolling;
mod scale;
mod source;
mod unlikely;

use crate::config_error::ConfigError;
use crate::database::Database;

use super::config::OdometryConfig;
use super::description::Description;
use super::kinematics::Kinematics;
use super::merge::Merge;
use super::message::Message;
use super::slip::SlipLimits;
pub(super) use gyro::plan as gyro;
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
    let (kinematics, slip) = kinematics(&mut planner, config)?;
    let (messages, channels, description) = planner.finish();
    Ok(Plan {
        messages,
        merge: Merge::new(channels, kinematics, config.tolerance).watching(slip),
        description,
    })
}

/// How the robot moves by what is read, and from what on its wheels slip.
fn kinematics<'a>(
    planner: &mut Planner<'a>,
    config: &'a OdometryConfig,
) -> Result<(Kinematics, Option<SlipLimits>), ConfigError> {
    check_kinds(config)?;
    let rigid = |kinematics| (kinematics, None);
    let watched = |(kinematics, slip)| (kinematics, Some(slip));
    if let Some(wheels) = &config.wheels {
        return axle::plan(planner, wheels).map(rigid);
    }
    if let Some(four) = &config.four_wheels {
        return rolling::four(planner, four).map(watched);
    }
    if let Some(bicycle) = &config.bicycle {
        return bicycle::plan(planner, bicycle).map(rigid);
    }
    if let Some(mecanum) = &config.mecanum {
        return rolling::mecanum(planner, mecanum).map(watched);
    }
    if let Some(omni) = &config.omni {
        return rolling::omni(planner, omni).map(watched);
    }
    match &config.body {
        Some(body) => body::plan(planner, body).map(rigid),
        None => Err(no_kind()),
    }
}

/// Exactly one table says how the robot moves.
fn check_kinds(config: &OdometryConfig) -> Result<(), ConfigError> {
    let kinds: Vec<_> = config.kinds().collect();
    match kinds.as_slice() {
        [] => Err(no_kind()),
        [_] => Ok(()),
        [first, second, ..] => Err(ConfigError::setting(
            *second,
            format!("is there beside [odometry.{first}]: {ONE_KIND}"),
        )),
    }
}

const ONE_KIND: &str = "give one of [odometry.wheels], [odometry.four_wheels], [odometry.bicycle], [odometry.mecanum], \
                        [odometry.omni] and [odometry.body]";

fn no_kind() -> ConfigError {
    let problem = format!("{ONE_KIND}; where [odometry.base] alone is heard, leave out buses");
    ConfigError::setting("wheels", problem)
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
