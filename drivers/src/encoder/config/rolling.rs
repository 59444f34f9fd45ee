//! `[odometry.four_wheels]`, `[odometry.mecanum]`, `[odometry.omni]`: wheels of which each says a part of the motion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{WheelConfig, one};

/// Four wheels that point forward, two a side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FourWheelsConfig {
    /// Distance between the left and the right wheels \[m\].
    #[schemars(range(max = 100), extend("exclusiveMinimum" = 0))]
    pub track_m: f64,
    /// So much of the turn that the wheels say is made: of one radian by `track_m`, so many. Below 1, as the wheels skid to turn:
    /// measure it by turning on the spot.
    #[serde(default = "one")]
    #[schemars(range(max = 10), extend("exclusiveMinimum" = 0))]
    pub turning_scale: f64,
    /// The two wheels of a side slip where their speeds differ by more than this and `slip_share` together \[m/s\].
    #[serde(default = "default_slip_mps")]
    #[schemars(range(min = 0, max = 1000))]
    pub slip_mps: f64,
    /// This part of the fastest wheel's speed, to which comes what whole counts leave open.
    #[serde(default = "default_slip_share")]
    #[schemars(range(min = 0, max = 10))]
    pub slip_share: f64,
    /// What every metre that a wheel rolls adds to the variance of its way, independently of the others; the covariance that
    /// this makes of the robot's velocity is added to the noise of `[motion]` \[m²/m\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e6))]
    pub wheel_per_m: f64,
    /// The left wheel in front.
    pub front_left: WheelConfig,
    /// The right wheel in front.
    pub front_right: WheelConfig,
    /// The left wheel behind.
    pub rear_left: WheelConfig,
    /// The right wheel behind.
    pub rear_right: WheelConfig,
}

/// Four mecanum wheels, their speeds positive when they drive forward.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MecanumConfig {
    /// Half the distance between the front and the rear axle \[m\].
    #[schemars(range(max = 100), extend("exclusiveMinimum" = 0))]
    pub half_length_m: f64,
    /// Half the distance between the left and the right wheels' middles \[m\].
    #[schemars(range(max = 100), extend("exclusiveMinimum" = 0))]
    pub half_width_m: f64,
    /// Wheels slip where one of them would have to be slower or faster by more than this and `slip_share` together
    /// to fit the others \[m/s\].
    #[serde(default = "default_slip_mps")]
    #[schemars(range(min = 0, max = 1000))]
    pub slip_mps: f64,
    /// This part of the fastest wheel's speed, to which comes what whole counts leave open.
    #[serde(default = "default_slip_share")]
    #[schemars(range(min = 0, max = 10))]
    pub slip_share: f64,
    /// What every metre that a wheel rolls adds to the variance of its way, independently of the others; the covariance that
    /// this makes of the robot's velocity is added to the noise of `[motion]` \[m²/m\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e6))]
    pub wheel_per_m: f64,
    /// The left wheel in front.
    pub front_left: WheelConfig,
    /// The right wheel in front.
    pub front_right: WheelConfig,
    /// The left wheel behind.
    pub rear_left: WheelConfig,
    /// The right wheel behind.
    pub rear_right: WheelConfig,
}

/// Three or four omni wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OmniConfig {
    /// Wheels slip where one of four would have to be slower or faster by more than this and `slip_share` together
    /// to fit the others \[m/s\].
    #[serde(default = "default_slip_mps")]
    #[schemars(range(min = 0, max = 1000))]
    pub slip_mps: f64,
    /// This part of the fastest wheel's speed, to which comes what whole counts leave open.
    #[serde(default = "default_slip_share")]
    #[schemars(range(min = 0, max = 10))]
    pub slip_share: f64,
    /// What every metre that a wheel rolls adds to the variance of its way, independently of the others; the covariance that
    /// this makes of the robot's velocity is added to the noise of `[motion]` \[m²/m\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e6))]
    pub wheel_per_m: f64,
    /// The wheels, three or four, an entry each.
    #[schemars(length(min = 3, max = 4))]
    pub wheels: Vec<OmniWheelConfig>,
}

/// An omni wheel, which rolls across the line from the robot's middle to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OmniWheelConfig {
    /// Where it is, seen from the middle: 0 in front, 90 on the left \[°\].
    #[schemars(range(min = -360, max = 360), example = 60.0)]
    pub angle_deg: f64,
    /// How far from the middle it touches the ground \[m\].
    #[schemars(range(max = 100), extend("exclusiveMinimum" = 0), example = 0.2)]
    pub distance_m: f64,
    /// Its signal; positive where it turns the robot counter-clockwise.
    #[schemars(example = WheelConfig::example("WheelLeft"))]
    pub wheel: WheelConfig,
}

fn default_slip_mps() -> f64 {
    0.05
}

fn default_slip_share() -> f64 {
    0.1
}

fn example_corners() -> [WheelConfig; 4] {
    ["FrontLeft", "FrontRight", "RearLeft", "RearRight"].map(WheelConfig::example)
}

impl FourWheelsConfig {
    pub(super) fn example() -> Self {
        let [front_left, front_right, rear_left, rear_right] = example_corners();
        Self {
            track_m: 0.5,
            turning_scale: 0.6,
            slip_mps: default_slip_mps(),
            slip_share: default_slip_share(),
            wheel_per_m: 0.0,
            front_left,
            front_right,
            rear_left,
            rear_right,
        }
    }

    /// Front left, front right, rear left, rear right.
    pub(in super::super) fn each(&self) -> [&WheelConfig; 4] {
        [
            &self.front_left,
            &self.front_right,
            &self.rear_left,
            &self.rear_right,
        ]
    }
}

impl MecanumConfig {
    pub(super) fn example() -> Self {
        let [front_left, front_right, rear_left, rear_right] = example_corners();
        Self {
            half_length_m: 0.25,
            half_width_m: 0.2,
            slip_mps: default_slip_mps(),
            slip_share: default_slip_share(),
            wheel_per_m: 0.0,
            front_left,
            front_right,
            rear_left,
            rear_right,
        }
    }

    /// Front left, front right, rear left, rear right.
    pub(in super::super) fn each(&self) -> [&WheelConfig; 4] {
        [
            &self.front_left,
            &self.front_right,
            &self.rear_left,
            &self.rear_right,
        ]
    }
}

impl OmniConfig {
    pub(super) fn example() -> Self {
        let wheel = |(angle_deg, message): (f64, &str)| OmniWheelConfig {
            angle_deg,
            distance_m: 0.2,
            wheel: WheelConfig::example(message),
        };
        Self {
            slip_mps: default_slip_mps(),
            slip_share: default_slip_share(),
            wheel_per_m: 0.0,
            wheels: [(60.0, "Wheel1"), (180.0, "Wheel2"), (300.0, "Wheel3")]
                .map(wheel)
                .into(),
        }
    }
}
