//! Wheel encoders: from CAN frames to velocities, and, for simulators, back.

mod channel;
mod config;
mod counter;
mod decoder;
mod description;
mod guard;
mod kinematics;
mod plan;
mod reject;
mod unit;
mod wheel_frames;
mod wrap;

pub use self::config::{
    BodyConfig, BodySignal, ConfigError, MessageConfig, OdometryConfig, Quantity, SpeedUnit,
    TurnUnit, WheelConfig, WheelsConfig,
};
pub use self::decoder::{OdometryDecoder, WheelOdometry};
pub use self::description::{Description, describe};
pub use self::reject::{FrameReject, OdometryCounters};
pub use self::wheel_frames::{LEFT_ID, RIGHT_ID, WheelFrames, encoder_frame};
