//! `robot.toml`: read once at start, refused as a whole before anything opens.
//!
//! [`sections`] says what can be written and is allowed, `defaults` and `presets` what is meant where nothing is written. From these two
//! `shape` makes the description that `review` holds a file against and that `reference` shows to people. `check` is for
//! what no single value tells, `unlikely` for what is allowed and was hardly meant; [`error`] is how a refusal reads,
//! [`understood`] how `colocd check` shows what it understood.
//! Nothing behind this module sees an unchecked value.

pub mod assist;
mod check;
mod defaults;
pub mod error;
mod example;
mod finding;
pub mod gyro;
mod hint;
mod initial_pose;
mod integrity;
mod location;
mod others;
mod places;
mod presets;
pub mod reference;
mod review;
mod rounds;
pub mod sections;
pub mod sensors;
mod shape;
pub mod understood;
mod unlikely;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use coloc_drivers::can::BusSpec;
use coloc_drivers::canopen::CanopenConfig;
use coloc_drivers::encoder::OdometryConfig;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::de::DeTable;

use error::Fault;

pub use assist::{Assist, AssistFusion, AssistMode};
pub use error::ConfigError;
pub use gyro::{Gyro, GyroSource};
pub use integrity::{Action, Integrity};
pub use others::{Section, SomebodyElses};
pub use rounds::Rounds;
pub use sensors::{Compass, Eye, Heading, Landmark, Receiver, RelativePose, Sensor, Sighting};

pub use sections::{
    Clock, ClockSource, Criterion, Fusion, GateWeight, Health, History, Initial, InitialHeading,
    InitialPose, LogLevel, Member, Mode, Motion, Partial, Position, Preset, Propagation, Realtime,
    Robot, Scheduler, Shm, StandsBy, Telemetry, Tick, Trigger, TrustJump, Variance, WaitMode,
};

/// A whole `robot.toml`. Only `[robot]` must be written; every other section has defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Who this robot is.
    #[schemars(example = Robot::example())]
    pub robot: Robot,
    /// Everybody it may hear from or speak to, an entry each. It may be listed too, so that all robots share the list.
    #[serde(default)]
    #[schemars(example = [Member::example()])]
    pub team: Vec<Member>,
    /// Which time stamps tell.
    #[serde(default)]
    pub clock: Clock,
    /// When a tick starts.
    #[serde(default)]
    pub tick: Tick,
    /// Where shared memory is.
    #[serde(default)]
    pub shm: Shm,
    /// Where the wheels are heard. Leave the section out for a robot whose wheels cannot be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = example_of_odometry())]
    pub odometry: Option<OdometryConfig>,
    /// CANopen drives that are mute until somebody starts them. Without this section nothing is sent on any bus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub canopen: Option<CanopenConfig>,
    /// Noise of the wheels, and what happens without their samples. A velocity's variance is a + b v² + c ω² + (`per_s` + `per_m` |v| +
    /// `per_rad` |ω|) / T, v in m/s, ω in rad/s, T being `reference_period_s`; `colocd check` says what that makes after 100 m and
    /// after an hour of standing.
    #[serde(default)]
    pub motion: Motion,
    /// A gyro beside the wheels: it turns the robot, they move it.
    #[serde(default)]
    pub gyro: Gyro,
    /// Where the robot is at start.
    #[serde(default)]
    pub initial: Initial,
    /// Receivers of a position: satellites, beacons.
    #[serde(default)]
    pub position: Position,
    /// Lasers and cameras that see other robots.
    #[serde(default)]
    pub relative_pose: RelativePose,
    /// Sensors that see other robots and landmarks in part: range and bearing, or one of the two.
    #[serde(default)]
    pub sighting: Sighting,
    /// Places that are known, an entry each: surveyed marks for a camera, beacons for a radio.
    #[serde(default)]
    #[schemars(example = [Landmark::example()])]
    pub landmark: Vec<Landmark>,
    /// Leaders and children: robots that know where they are carry those that do not, also where none of them sees them.
    #[serde(default)]
    pub assist: Assist,
    /// Sensors of the heading: compass, two antennas, course over ground.
    #[serde(default)]
    pub heading: Heading,
    /// How poses and fixes are fused.
    #[serde(default)]
    pub fusion: Fusion,
    /// When the team makes rounds, with `fusion.mode = "rounds"`. Read by `coloc-rounds` as well.
    #[serde(default)]
    pub rounds: Rounds,
    /// How far back a late measurement may reach.
    #[serde(default)]
    pub history: History,
    /// A sensor whose newest sample is older than this at a tick is stale.
    #[serde(default)]
    pub health: Health,
    /// What the operating system is asked for; what it does not grant is reported with what to do about it.
    #[serde(default)]
    pub realtime: Realtime,
    /// Logs, status, state file.
    #[serde(default)]
    pub telemetry: Telemetry,
    /// Read by `coloc-gnss`.
    #[serde(default, skip_serializing)]
    #[schemars(skip)]
    pub gnss: SomebodyElses,
    /// Read by `coloc-laser`.
    #[serde(default, skip_serializing)]
    #[schemars(skip)]
    pub laser: SomebodyElses,
    /// Read by `coloc-track`.
    #[serde(default, skip_serializing)]
    #[schemars(skip)]
    pub track: SomebodyElses,
    /// Read by `coloc-bounds`.
    #[serde(default, skip_serializing)]
    #[schemars(skip)]
    pub bounds: SomebodyElses,
    /// Read by `coloc-bounds`, but for what `colocd` does with its word.
    #[serde(default, skip_serializing)]
    #[schemars(skip)]
    pub integrity: Integrity,
    /// Read by `coloc-link`.
    #[serde(default, skip_serializing)]
    #[schemars(skip)]
    pub link: SomebodyElses,
}

/// A configuration that is allowed, and what is unlikely about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Examined {
    /// What it says.
    pub config: Config,
    /// Sentences for the person who wrote it, each with file and line.
    pub warnings: Vec<String>,
}

impl Config {
    /// Everything as it is by default, without wheels: for programs that run robots. It is not checked; what is written of it
    /// (it can be serialized as TOML) and read again is.
    #[must_use]
    pub fn of(robot: Robot) -> Self {
        Self {
            robot,
            team: Vec::new(),
            clock: Clock::default(),
            tick: Tick::default(),
            shm: Shm::default(),
            odometry: None,
            canopen: None,
            motion: Motion::default(),
            gyro: Gyro::default(),
            initial: Initial::default(),
            position: Position::default(),
            relative_pose: RelativePose::default(),
            sighting: Sighting::default(),
            landmark: Vec::new(),
            assist: Assist::default(),
            heading: Heading::default(),
            fusion: Fusion::default(),
            rounds: Rounds::default(),
            history: History::default(),
            health: Health::default(),
            realtime: Realtime::default(),
            telemetry: Telemetry::default(),
            gnss: SomebodyElses::default(),
            laser: SomebodyElses::default(),
            track: SomebodyElses::default(),
            bounds: SomebodyElses::default(),
            integrity: Integrity::default(),
            link: SomebodyElses::default(),
        }
    }

    /// The pose that the robot starts with, if one is known.
    #[must_use]
    pub fn initial_pose(&self) -> Option<[f64; 3]> {
        match self.initial.pose {
            Some(InitialPose::Given(pose)) => Some(pose),
            Some(InitialPose::Unknown) => None,
            None => (self.position.receivers == 0).then_some([0.0; 3]),
        }
    }

    /// Reads and checks the file at `path`.
    ///
    /// # Errors
    /// What is wrong, with file, line, value and what is allowed.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Self::parse(&read(path)?, path)
    }

    /// Reads and checks `text`; `path` is for the errors, and where relative paths begin.
    ///
    /// # Errors
    /// As [`Config::load`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, ConfigError> {
        Self::parse_text(text, path).map_err(|faults| ConfigError::new(path, text, faults))
    }

    /// Reads and checks the file at `path`, and looks for what is unlikely.
    ///
    /// # Errors
    /// As [`Config::load`].
    pub fn examine(path: &Path) -> Result<Examined, ConfigError> {
        let text = read(path)?;
        let config = Self::parse(&text, path)?;
        let warnings = error::warnings(path, &text, unlikely_faults(&config, &text));
        Ok(Examined { config, warnings })
    }

    fn parse_text(text: &str, path: &Path) -> Result<Self, Vec<Fault>> {
        let document = DeTable::parse(text).map_err(|error| vec![Fault::no_toml(&error, text)])?;
        let document = document.get_ref();
        none_of(review::review(text, document))?;
        let mut config: Self =
            toml::from_str(text).map_err(|error| vec![Fault::no_value(&error, document)])?;
        config.resolve(path.parent().unwrap_or(Path::new("")));
        let refused = check::check(&config, path);
        none_of(
            refused
                .iter()
                .map(|finding| Fault::found(finding, document)),
        )?;
        Ok(config)
    }
}

/// Nobody writes longer ones; a device has no end.
const LONGEST: u64 = 1 << 20;

fn read(path: &Path) -> Result<String, ConfigError> {
    read_at_most(LONGEST, path).map_err(|error| ConfigError::unreadable(path, &error))
}

fn read_at_most(most: u64, path: &Path) -> std::io::Result<String> {
    let mut bytes = Vec::new();
    let read = File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if read as u64 > most {
        let too_long = format!("it is longer than {most} bytes; is it the right file?");
        return Err(std::io::Error::other(too_long));
    }
    let no_text = |_| std::io::Error::other("it is no text in UTF-8; save it as UTF-8");
    String::from_utf8(bytes).map_err(no_text)
}

/// `text` is that of `config`, which was read before.
fn unlikely_faults(config: &Config, text: &str) -> Vec<Fault> {
    let Ok(document) = DeTable::parse(text) else {
        return Vec::new();
    };
    let fault = |finding| Fault::found(&finding, document.get_ref());
    unlikely::unlikely(config).into_iter().map(fault).collect()
}

fn none_of(faults: impl IntoIterator<Item = Fault>) -> Result<(), Vec<Fault>> {
    let faults: Vec<_> = faults.into_iter().collect();
    if faults.is_empty() {
        Ok(())
    } else {
        Err(faults)
    }
}

fn example_of_odometry() -> OdometryConfig {
    let can0 = BusSpec::SocketCan {
        interface: "can0".into(),
    };
    OdometryConfig::differential(can0, 0.3, 1e-4, 2.0)
}

impl Config {
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
