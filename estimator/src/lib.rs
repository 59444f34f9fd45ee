//! The mathematics of coloc: decentralized cooperative localization with dead reckoning that carries the bend of its belief
//! ([`honest`]) and split covariance intersection. The cubature Kalman filter of the paper is there too ([`Propagation::Paper`]).
//!
//! # Principles
//!
//! * **Data in, data out.** No clock, no I/O, no randomness, no allocation, no `unsafe`: the crate is
//!   `#![no_std]` without `alloc`, so the compiler proves the second half of that sentence.
//! * **Same inputs, same bits.** Transcendental functions come from `libm`, never from the platform, and no
//!   loop's length depends on anything but the data. A recording replays to the same bits on any machine.
//! * **Measured time, not arrival time.** Whatever the order in which a set of measurements is delivered,
//!   the belief is the same to the last bit ([`history`]).
//! * **Never lie.** Both parts of a covariance stay symmetric positive semidefinite; a singular matrix (a part that is zero) is
//!   a normal state, not an error.
//!
//! Equation numbers in brackets, such as \[30\], are those of T. R. Wanasinghe, G. K. I. Mann, R. G. Gosine,
//! "Decentralized Cooperative Localization Approach for Autonomous Multirobot Systems", Journal of Robotics
//! 2016, 2560573.
#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::float_cmp))] // Where tests compare floats exactly, they mean it.

pub mod angle;
pub mod assist;
pub mod belief;
mod clip;
mod compose;
pub mod convert;
pub mod covariance;
pub mod estimator;
mod factor;
mod filter;
pub mod fix;
pub mod found;
pub mod fusion;
pub mod gate;
pub mod gyro;
pub mod heading;
pub mod history;
pub mod honest;
pub mod input;
pub mod join;
pub mod kind;
mod lever;
mod list;
pub mod motion;
pub mod noise;
mod outbox;
pub mod output;
pub mod pace;
pub mod partial;
pub mod parts;
pub mod pose;
mod root;
mod rotate;
pub mod rounds;
pub mod settings;
mod slow;
mod split;
pub mod stamp;
mod symmetric;
mod terms;
mod turn;
mod twin;
mod weight;

pub use belief::{Belief, NotABelief};
pub use convert::{GlobalPose, to_global};
pub use covariance::{Covariance2, Covariance3, NotACovariance};
pub use estimator::{Estimator, step};
pub use fix::FixUpdate;
pub use found::{Decision, Dissent, Finding, FindingState, FoundSettings, Start, TrustJump};
pub use fusion::{Fusion, fuse};
pub use gyro::{GyroSettings, GyroState};
pub use history::{GYRO_SAMPLES, MOST_SLOTS, Slot, Storage, WithBonds, WithGyro};
pub use honest::{Bend, Increments};
pub use input::TickInputs;
pub use kind::{
    Answer, Ask, Deed, GyroSample, HeadingFix, HeadingOf, Kind, LandmarkSighting, LeaderPose,
    Measurement, NeighbourPose, OdometrySample, Origin, PartialSighting, PoseSaid, PositionFix,
    RobotId, RoundWord, SeenPart, Sighting, SightingId, SlowError, TrackPose,
};
pub use motion::{Motion, propagate};
pub use noise::OdometryNoise;
pub use output::{
    Estimate, OdometryState, OutgoingAnswer, OutgoingPose, OutgoingSeen, Report, Source,
    TickOutputs, Verdict,
};
pub use pace::Pace;
pub use parts::Parts;
pub use pose::Pose;
pub use settings::{Floors, FusionSettings, OdometrySettings, Propagation, Settings};
pub use stamp::{Span, Stamp};
