//! The filters of the thesis, as they are printed: for comparison alone.
//!
//! Both begin at any heading with a variance of π²/3, go by Euler's step, (5.7), and have no gate. A heading that begins so may be
//! wrong by π, and the filter settles there.

mod four;
mod printed;
mod traditional;

pub use four::{FourState, SpatialReading};
pub use printed::{Printed, euler, process_noise};
pub use traditional::Traditional;
