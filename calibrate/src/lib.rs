//! What a recorded drive says of the robot that drove it: scales of its wheels, noises, offsets of its gyro and its receivers, and
//! how well it says so.
//!
//! ```text
//! drive ──► filter (the estimator's own step, robot) ──► likelihood ──► fit ──► found, with intervals; what is not shown
//!                                                                       └─────► judge (a part that was not used)
//! ```
//!
//! # Principles
//!
//! * **The product's own step.** Between fixes the belief goes through [`coloc_estimator::honest::advance`]; only what the estimator
//!   does not have is added (`filter`).
//! * **No number without its doubt.** What a drive does not show is not changed, and the manoeuvre that shows it is named.
//! * **Judged on what it has not seen.**
#![forbid(unsafe_code)]

mod drive;
mod filter;
mod fit;
mod judge;
mod likelihood;
mod parameter;
mod robot;
mod sample;
mod slope;
mod start;
pub mod survey;
mod symmetric;

pub use drive::{Drive, Fix, State, Way};
pub use fit::{Fit, Found, NoFit, Progress, bound, fit};
pub use judge::{Judgement, dead_reckoning};
pub use parameter::{Cause, Direction, Parameter};
pub use robot::{Base, Coefficients, Gyro, Receiver, Robot, Wheels};
pub use sample::SampleSize;
