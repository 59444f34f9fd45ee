//! `[odometry.bicycle]`: a car by its steering angle.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{WheelConfig, one};

/// A car whose front wheels are steered, by their angle and one speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BicycleConfig {
    /// From the rear axle to the front axle \[m\].
    #[schemars(range(max = 100), extend("exclusiveMinimum" = 0))]
    pub wheel_base_m: f64,
    /// How far left of the middle of the rear axle the speed is measured: half the track for the left rear wheel, minus that for
    /// the right one, 0 for the middle, as a drive shaft says it \[m\].
    #[serde(default)]
    #[schemars(range(min = -10, max = 10))]
    pub lateral_m: f64,
    /// The rear wheel, or what says how fast the middle of the rear axle is.
    pub wheel: WheelConfig,
    /// The steering angle.
    pub steering: SteeringConfig,
}

/// Where to find the steering angle, and what its numbers mean: the angle of the road wheels is (signal − `straight`) / `ratio`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SteeringConfig {
    /// Its bus, by position in `buses`.
    #[serde(default)]
    pub bus: u8,
    /// Name of the message in the DBC file.
    pub message: String,
    /// Name of the signal in the message.
    pub signal: String,
    /// The signal's unit.
    #[serde(default)]
    pub unit: AngleUnit,
    /// What the signal says while the robot drives straight, in its unit.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub straight: f64,
    /// How far the signal turns for the road wheels to turn by one: about 15 where it is the steering wheel's angle.
    #[serde(default = "one")]
    #[schemars(range(max = 1000), extend("exclusiveMinimum" = 0))]
    pub ratio: f64,
    /// Positive is to the right.
    #[serde(default)]
    pub reversed: bool,
    /// The road wheels never turn farther: what exceeds it is garbage \[rad\].
    #[serde(default = "default_max_rad")]
    #[schemars(range(max = 1.5), extend("exclusiveMinimum" = 0))]
    pub max_rad: f64,
    /// Noise of the road wheels' angle, another in each frame: its standard deviation \[rad\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 1))]
    pub sigma_rad: f64,
}

/// Units of an angle.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AngleUnit {
    /// Radians.
    #[default]
    Radians,
    /// Degrees.
    Degrees,
}

fn default_max_rad() -> f64 {
    0.8
}

impl BicycleConfig {
    pub(super) fn example() -> Self {
        Self {
            wheel_base_m: 1.2,
            lateral_m: 0.0,
            wheel: WheelConfig::example("WheelLeft"),
            steering: SteeringConfig {
                bus: 0,
                message: "Steering".to_owned(),
                signal: "Angle".to_owned(),
                unit: AngleUnit::default(),
                straight: 0.0,
                ratio: 1.0,
                reversed: false,
                max_rad: default_max_rad(),
                sigma_rad: 0.0,
            },
        }
    }
}
