//! A fleet without robots: recorded and synthetic worlds, the sensors that would be on them, rival
//! estimators, and the figures that tell which of them to believe.
//!
//! # Principles
//!
//! * **One seed.** Every random number is a pure function of (seed, run, robot, sensor, step)
//!   ([`random::Noise`]): switching one option on or off leaves all other noise as it was, and results do not
//!   depend on the number of threads.
//! * **The product is what is measured.** The methods `split-ci` and `coloc` call the functions of
//!   [`coloc_estimator`] itself; the rivals share everything with them but the fusion ([`method`]).
//! * **Data is checked where it enters.** A recording's defects become errors that name file and line, or a
//!   truth that is honestly absent; nothing beyond the reader meets a malformed number.
#![forbid(unsafe_code)]

pub mod calibrate;
pub mod campaign;
pub mod car;
pub mod dead_reckoning;
pub mod dkf;
pub mod evaluate;
pub mod fleet;
pub mod found;
pub mod gyro;
pub mod honest;
pub mod integrity;
pub mod laser;
pub mod leaders;
pub mod memory;
pub mod method;
pub mod metrics;
pub mod mrclam;
pub mod partial;
pub mod promises;
pub mod random;
pub mod rounds;
pub mod scale;
pub mod scenario;
pub mod sensors;
pub mod synthetic;
pub mod uwb;
pub mod world;

pub use fleet::{Fleet, Letter, Note};
pub use scenario::Scenario;
pub use sensors::{Sensors, StepInputs};
pub use synthetic::{Synthetic, SyntheticConfig, Ways};
pub use world::World;
