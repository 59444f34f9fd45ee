//! What a person writes about the wheels of a robot.
//!
//! The comment at a setting is what a person reads about it, its unit at the end in brackets; `range` is what is
//! allowed. Only here are both said.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::can::BusSpec;

use super::tolerance::Tolerance;

mod bicycle;
mod rolling;

pub use bicycle::{AngleUnit, BicycleConfig, SteeringConfig};
pub use rolling::{FourWheelsConfig, MecanumConfig, OmniConfig, OmniWheelConfig};

/// Buses, and the signals on them that tell how the robot moves.
///
/// ```toml
/// buses = ["socketcan:can0"]
/// max_speed_mps = 2.0
/// [wheels]
/// track_m = 0.287
/// left = { message = "WheelLeft", signal = "Ticks", metres_per_tick = 1e-4 }
/// right = { message = "WheelRight", signal = "Ticks", metres_per_tick = 1e-4 }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OdometryConfig {
    /// CAN buses: `socketcan:INTERFACE`, `candump:FILE[?interface=NAME]` or `local:DIRECTORY`, relative paths beginning where
    /// this file is. A wheel names its own by position: the first is 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<String>", length(max = 256), example = example_buses())]
    pub buses: Vec<BusSpec>,
    /// The file that describes the messages, looked for beside this one; without it they are coloc's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"robot.dbc")]
    pub dbc: Option<PathBuf>,
    /// Faster than a wheel or the robot can ever be: what exceeds it is garbage \[m/s\].
    #[schemars(range(max = 1000), extend("exclusiveMinimum" = 0))]
    pub max_speed_mps: f64,
    /// Faster than the robot can ever turn; for velocities of the body \[rad/s\].
    #[serde(default = "default_max_turn_rate_radps")]
    #[schemars(range(max = 1000), extend("exclusiveMinimum" = 0))]
    pub max_turn_rate_radps: f64,
    /// The two wheels of an axle: differential drive, tracks, or the rear wheels of a car. One of this, `four_wheels`, `bicycle`,
    /// `mecanum`, `omni` and `body`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wheels: Option<WheelsConfig>,
    /// Four wheels that point forward, two a side, turning as the sides differ: skid-steer. Instead of `wheels`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = FourWheelsConfig::example())]
    pub four_wheels: Option<FourWheelsConfig>,
    /// A steered car by the angle of its front wheels and one speed. Instead of `wheels`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = BicycleConfig::example())]
    pub bicycle: Option<BicycleConfig>,
    /// Four mecanum wheels, whose rollers stand at 45°; those that touch the ground make a diamond, seen from above. Instead of
    /// `wheels`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = MecanumConfig::example())]
    pub mecanum: Option<MecanumConfig>,
    /// Three or four omni wheels, each across the line to the robot's middle. Instead of `wheels`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = OmniConfig::example())]
    pub omni: Option<OmniConfig>,
    /// Velocities of the body, of robots that measure those. Instead of `wheels`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = BodyConfig::example())]
    pub body: Option<BodyConfig>,
    /// How the frames of a message prove that they are new and whole; coloc's own do so without being listed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(example = MessageConfig::examples())]
    pub messages: Vec<MessageConfig>,
    /// A base that does not speak CAN: how it moves is heard on the channel `odometry`, beside the buses or instead of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = BaseConfig::example())]
    pub base: Option<BaseConfig>,
    /// How much disorder is usual: what the decoder takes for accidents.
    #[serde(default)]
    pub tolerance: Tolerance,
}

/// What a base means by what it says. Velocities need nothing of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BaseConfig {
    /// Distance between its wheels; needed if it says distances or counts of wheels \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 100), extend("exclusiveMinimum" = 0), example = 0.3)]
    pub track_m: Option<f64>,
    /// How far the left and the right wheel roll in one count; needed if it says counts \[m, m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 1e-9, max = 10)), example = BaseConfig::example_counts())]
    pub metres_per_count: Option<[f64; 2]>,
    /// It can move sideways: a velocity that says no covariance has the noise of one that does.
    #[serde(default)]
    pub sideways: bool,
    /// No velocity is taken to be more certain than this, whatever it says: least standard deviations of `v_x`, `v_y` and ω in
    /// the interval of a message \[m/s, m/s, rad/s\].
    #[serde(default)]
    #[schemars(inner(range(min = 0, max = 1000)))]
    pub floor: [f64; 3],
}

fn example_buses() -> [&'static str; 1] {
    ["socketcan:can0"]
}

fn default_max_turn_rate_radps() -> f64 {
    10.0
}

fn one() -> f64 {
    1.0
}

/// The two wheels of an axle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WheelsConfig {
    /// Distance between the points where the wheels touch the ground \[m\].
    #[schemars(range(max = 100), extend("exclusiveMinimum" = 0))]
    pub track_m: f64,
    /// So much of the turn that the wheels say is made: of one radian by `track_m`, so many. Below 1 where wheels or tracks skid
    /// to turn: measure it by turning on the spot.
    #[serde(default = "one")]
    #[schemars(range(max = 10), extend("exclusiveMinimum" = 0))]
    pub turning_scale: f64,
    /// The left wheel.
    pub left: WheelConfig,
    /// The right wheel.
    pub right: WheelConfig,
}

/// Where to find one wheel and what its numbers mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WheelConfig {
    /// Its bus, by position in `buses`.
    #[serde(default)]
    pub bus: u8,
    /// Name of the message in the DBC file.
    pub message: String,
    /// Name of the signal in the message.
    pub signal: String,
    /// What the signal says, after the DBC file's factor and offset.
    #[serde(default)]
    pub quantity: Quantity,
    /// How far the wheel rolls in one tick; or give `wheel_radius_m` and `ticks_per_revolution` \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 10), extend("exclusiveMinimum" = 0), example = 1e-4)]
    pub metres_per_tick: Option<f64>,
    /// Rolling radius \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 10), extend("exclusiveMinimum" = 0), example = 0.05)]
    pub wheel_radius_m: Option<f64>,
    /// Ticks in one turn of the wheel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0), example = 4096.0)]
    pub ticks_per_revolution: Option<f64>,
    /// Time from one frame to the next; must be written for `ticks_per_period`. Else it is what the DBC file says
    /// (`GenMsgCycleTime`), or 0.02: a counter must not get half round in it at `max_speed_mps` \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 10), extend("exclusiveMinimum" = 0), example = 0.02)]
    pub period_s: Option<f64>,
    /// For `cumulative_ticks` that do not use every count their bits have: how many different counts there are, 251 where 0
    /// follows 250.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 2, max = 1e15), example = 251)]
    pub modulus: Option<u64>,
    /// It counts backwards when the robot drives forwards.
    #[serde(default)]
    pub reversed: bool,
}

/// What a wheel's signal says, after the DBC file's factor and offset.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Ticks since the encoder started; wraps at the signal's width, or at `modulus`.
    #[default]
    CumulativeTicks,
    /// Ticks since the frame before.
    TicksPerPeriod,
    /// Metres per second.
    MetresPerSecond,
    /// Kilometres per hour.
    KilometresPerHour,
    /// Radians per second of the wheel.
    RadiansPerSecond,
    /// Turns of the wheel per minute.
    RevolutionsPerMinute,
}

/// Velocities of the body in its own frame: x forward, y left, counter-clockwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyConfig {
    /// The velocity forward, `v_x`.
    pub forward: BodySignal<SpeedUnit>,
    /// The velocity to the left, `v_y`, of robots that can move sideways.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = BodySignal::<SpeedUnit>::example("SideSpeed"))]
    pub sideways: Option<BodySignal<SpeedUnit>>,
    /// The turning rate ω, counter-clockwise.
    pub turn: BodySignal<TurnUnit>,
}

/// Where to find a velocity of the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(bound = "U: Default + Serialize + JsonSchema")]
pub struct BodySignal<U: Default> {
    /// Its bus, by position in `buses`.
    #[serde(default)]
    pub bus: u8,
    /// Name of the message in the DBC file.
    pub message: String,
    /// Name of the signal in the message.
    pub signal: String,
    /// The signal's unit.
    #[serde(default)]
    pub unit: U,
    /// Its sign is the opposite of ours.
    #[serde(default)]
    pub reversed: bool,
}

/// Units of speed.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpeedUnit {
    /// Metres per second.
    #[default]
    MetresPerSecond,
    /// Kilometres per hour.
    KilometresPerHour,
}

/// Units of turn rate.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TurnUnit {
    /// Radians per second.
    #[default]
    RadiansPerSecond,
    /// Degrees per second.
    DegreesPerSecond,
}

/// How the frames of a message prove that they are new and whole.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MessageConfig {
    /// Name of the message in the DBC file.
    pub message: String,
    /// Signal that counts the frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"Alive")]
    pub alive: Option<String>,
    /// Signal with the CRC-8 SAE J1850 over the identifier (low byte first; two bytes, extended four) and all bytes
    /// before the checksum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"Checksum")]
    pub checksum: Option<String>,
}

impl OdometryConfig {
    /// A differential drive with coloc's own encoders on one bus.
    #[must_use]
    pub fn differential(
        bus: BusSpec,
        track_m: f64,
        metres_per_tick: f64,
        max_speed_mps: f64,
    ) -> Self {
        let [left, right] =
            ["WheelLeft", "WheelRight"].map(|message| WheelConfig::coloc(message, metres_per_tick));
        Self {
            buses: vec![bus],
            wheels: Some(WheelsConfig {
                track_m,
                turning_scale: 1.0,
                left,
                right,
            }),
            ..Self::of(max_speed_mps)
        }
    }

    /// Nothing but a speed limit.
    #[must_use]
    pub fn of(max_speed_mps: f64) -> Self {
        Self {
            buses: Vec::new(),
            dbc: None,
            max_speed_mps,
            max_turn_rate_radps: default_max_turn_rate_radps(),
            wheels: None,
            four_wheels: None,
            bicycle: None,
            mecanum: None,
            omni: None,
            body: None,
            messages: Vec::new(),
            base: None,
            tolerance: Tolerance::default(),
        }
    }

    /// The tables that say how the robot moves by what is on its buses; exactly one may be there.
    pub(super) fn kinds(&self) -> impl Iterator<Item = &'static str> {
        let kinds = [
            ("wheels", self.wheels.is_some()),
            ("four_wheels", self.four_wheels.is_some()),
            ("bicycle", self.bicycle.is_some()),
            ("mecanum", self.mecanum.is_some()),
            ("omni", self.omni.is_some()),
            ("body", self.body.is_some()),
        ];
        kinds.into_iter().filter(|(_, there)| *there).map(|it| it.0)
    }

    /// Each of the wheels whose counts or speeds are read.
    pub fn each_wheel(&self) -> impl Iterator<Item = &WheelConfig> {
        let axle = self.wheels.iter().flat_map(|it| [&it.left, &it.right]);
        let four = self.four_wheels.iter().flat_map(FourWheelsConfig::each);
        let bicycle = self.bicycle.iter().map(|it| &it.wheel);
        let mecanum = self.mecanum.iter().flat_map(MecanumConfig::each);
        let omni = self.omni.iter().flat_map(|it| &it.wheels);
        let rolling = axle.chain(four).chain(bicycle).chain(mecanum);
        rolling.chain(omni.map(|it| &it.wheel))
    }

    /// Whether it measures that the robot moves sideways.
    #[must_use]
    pub fn moves_sideways(&self) -> bool {
        let body = self.body.as_ref();
        let says = body.is_some_and(|body| body.sideways.is_some());
        let base = self.base.as_ref().is_some_and(|base| base.sideways);
        says || base || self.mecanum.is_some() || self.omni.is_some()
    }

    /// Whether anything of it comes over CAN. What has no base has to.
    #[must_use]
    pub fn is_on_can(&self) -> bool {
        let is_said = !self.buses.is_empty() || self.kinds().next().is_some();
        is_said || self.base.is_none()
    }
}

impl BaseConfig {
    fn example() -> Self {
        Self {
            track_m: Some(0.3),
            ..Self::default()
        }
    }

    fn example_counts() -> [f64; 2] {
        [1e-4; 2]
    }
}

impl WheelConfig {
    /// Cumulative ticks in this signal of this message, of a length that is not said yet.
    #[must_use]
    pub fn new(message: &str, signal: &str) -> Self {
        Self {
            bus: 0,
            message: message.to_owned(),
            signal: signal.to_owned(),
            quantity: Quantity::CumulativeTicks,
            metres_per_tick: None,
            wheel_radius_m: None,
            ticks_per_revolution: None,
            period_s: None,
            modulus: None,
            reversed: false,
        }
    }

    fn example(message: &str) -> Self {
        Self::coloc(message, 1e-4)
    }

    fn coloc(message: &str, metres_per_tick: f64) -> Self {
        Self {
            metres_per_tick: Some(metres_per_tick),
            ..Self::new(message, "Ticks")
        }
    }
}

impl BodyConfig {
    fn example() -> Self {
        Self {
            forward: BodySignal::example("Speed"),
            sideways: None,
            turn: BodySignal::example("YawRate"),
        }
    }
}

impl<U: Default> BodySignal<U> {
    fn example(signal: &str) -> Self {
        Self {
            bus: 0,
            message: "Body".to_owned(),
            signal: signal.to_owned(),
            unit: U::default(),
            reversed: false,
        }
    }
}

impl MessageConfig {
    fn examples() -> [Self; 1] {
        [Self {
            message: "Body".to_owned(),
            alive: Some("Alive".to_owned()),
            checksum: Some("Checksum".to_owned()),
        }]
    }

    pub(super) fn coloc() -> [Self; 2] {
        ["WheelLeft", "WheelRight"].map(|message| Self {
            message: message.to_owned(),
            alive: Some("Alive".to_owned()),
            checksum: Some("Checksum".to_owned()),
        })
    }
}
