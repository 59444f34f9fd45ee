//! Wheel encoders: from CAN frames, or from what a base says, to velocities, and, for simulators, back.

mod base;
mod bicycle;
mod channel;
mod config;
mod count;
mod counter;
mod counters;
mod decoder;
mod description;
mod guard;
mod gyro;
mod kinematics;
mod least_squares;
mod merge;
mod message;
mod plan;
mod reject;
mod said;
mod slip;
mod tolerance;
mod unit;
mod wheel_frames;
mod words;
mod wrap;

pub use self::base::{BaseDecoder, BaseReading};
pub use self::config::{
    AngleUnit, BaseConfig, BicycleConfig, BodyConfig, BodySignal, FourWheelsConfig, MecanumConfig,
    MessageConfig, OdometryConfig, OmniConfig, OmniWheelConfig, Quantity, SpeedUnit,
    SteeringConfig, TurnUnit, WheelConfig, WheelsConfig,
};
pub use self::counters::OdometryCounters;
pub use self::decoder::OdometryDecoder;
pub use self::description::{Description, Expected, SignalDescription};
pub use self::gyro::{GyroDecoder, GyroReading};
pub use self::merge::{MAX_CHANNELS, Rest, STILL_AFTER_NS, WheelOdometry};
pub use self::plan::{describe, warnings};
pub use self::reject::FrameReject;
pub use self::slip::Slip;
pub use self::tolerance::Tolerance;
pub use self::wheel_frames::{LEFT_ID, RIGHT_ID, WheelFrames, encoder_frame};
pub use self::words::{Length, Rounded, Time};
pub use crate::config_error::ConfigError;
