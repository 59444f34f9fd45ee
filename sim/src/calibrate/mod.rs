//! Whether a calibration finds what is true, and says how well: hundreds of drives of robots whose truth is known.

mod bars;
mod world;

pub use bars::{Form, coverage, refusals};
pub use world::{Course, Leg, configured, drive, true_robot};
