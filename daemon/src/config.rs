//! `robot.toml`: read once at start, refused as a whole before anything opens.
//!
//! [`sections`] says what can be written (`defaults` what is meant where nothing is), [`check`] what is allowed,
//! [`error`] how a refusal reads, [`summary`] how `colocd check` shows what it understood. Nothing behind this module
//! sees an unchecked value.

pub mod check;
mod defaults;
pub mod error;
mod places;
pub mod sections;
pub mod summary;

use std::path::Path;

use coloc_drivers::encoder::OdometryConfig;
use serde::Deserialize;

pub use error::ConfigError;
pub use sections::{
    Clock, ClockSource, Criterion, Fusion, GateWeight, Health, History, Initial, LogLevel, Member,
    Motion, Realtime, Robot, Scheduler, Shm, Telemetry, Tick, Trigger, Variance, WaitMode,
};

/// A whole `robot.toml`. Only `[robot]` must be written; every other section has defaults.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Who this robot is.
    pub robot: Robot,
    /// Everybody it may hear from or speak to; itself may be listed too, so that all robots share the list.
    #[serde(default)]
    pub team: Vec<Member>,
    /// Which clock stamps are of.
    #[serde(default)]
    pub clock: Clock,
    /// When a tick starts.
    #[serde(default)]
    pub tick: Tick,
    /// Where shared memory is.
    #[serde(default)]
    pub shm: Shm,
    /// The wheels' buses and signals; a robot without this section has no wheels to hear.
    #[serde(default)]
    pub odometry: Option<OdometryConfig>,
    /// Noise of the wheels, and what happens between and after their samples.
    #[serde(default)]
    pub motion: Motion,
    /// Where the robot is at start.
    #[serde(default)]
    pub initial: Initial,
    /// How poses and fixes are fused.
    #[serde(default)]
    pub fusion: Fusion,
    /// How far back a late measurement may reach.
    #[serde(default)]
    pub history: History,
    /// From when on a silent sensor is stale.
    #[serde(default)]
    pub health: Health,
    /// What the operating system is asked for.
    #[serde(default)]
    pub realtime: Realtime,
    /// Logs, status, state file.
    #[serde(default)]
    pub telemetry: Telemetry,
}

impl Config {
    /// Reads and checks the file at `path`.
    ///
    /// # Errors
    /// The first thing that is wrong, with file, line, value and what is allowed.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let text =
            std::fs::read_to_string(path).map_err(|error| ConfigError::unreadable(path, &error))?;
        Self::parse(&text, path)
    }

    /// Reads and checks `text`; `path` is for the errors only.
    ///
    /// # Errors
    /// As [`Config::load`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, ConfigError> {
        let mut config: Self =
            toml::from_str(text).map_err(|error| ConfigError::from_toml(&error, text, path))?;
        config.resolve(path.parent().unwrap_or(Path::new("")));
        check::check(&config).map_err(|refusal| ConfigError::from_refusal(&refusal, text, path))?;
        Ok(config)
    }
}

impl Config {
    /// A DBC file is looked for where the configuration is.
    fn resolve(&mut self, directory: &Path) {
        if let Some(dbc) = self
            .odometry
            .as_mut()
            .and_then(|odometry| odometry.dbc.as_mut())
        {
            *dbc = directory.join(&*dbc);
        }
    }

    /// The team without this robot.
    pub fn peers(&self) -> impl Iterator<Item = &Member> {
        self.team.iter().filter(|member| member.id != self.robot.id)
    }

    /// The tick's period \[ns\].
    #[must_use]
    pub fn period_ns(&self) -> i64 {
        nanos(1.0 / self.tick.rate_hz)
    }
}

/// Seconds that were checked with the configuration: at most a day.
#[must_use]
#[allow(clippy::cast_possible_truncation)]
pub(crate) fn nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}
