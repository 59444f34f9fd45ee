//! Wheel encoders: from CAN frames to velocities, and, for simulators, back.

mod channel;
mod config;
mod count;
mod counter;
mod counters;
mod decoder;
mod description;
mod guard;
mod kinematics;
mod message;
mod plan;
mod reject;
mod unit;
mod wheel_frames;
mod words;
mod wrap;

pub use self::config::{
    BodyConfig, BodySignal, MessageConfig, OdometryConfig, Quantity, SpeedUnit, TurnUnit,
    WheelConfig, WheelsConfig,
};
pub use self::counters::OdometryCounters;
pub use self::decoder::{MAX_CHANNELS, OdometryDecoder, WheelOdometry};
pub use self::description::{Description, Expected, SignalDescription};
pub use self::plan::describe;
pub use self::reject::FrameReject;
pub use self::wheel_frames::{LEFT_ID, RIGHT_ID, WheelFrames, encoder_frame};
pub use self::words::{Length, Rounded, Time};
pub use crate::config_error::ConfigError;
