//! Ranging radios: what they say too much, learned for every pair of radios while they are used.
//!
//! A radio measures how long a signal takes. What it says is `ρ = o + (1 + s) r + n`: an offset, because antennas and circuits take
//! time; a scale, because clocks and the firmware's table err; and noise. Offset and scale hardly change, so they are no noise: with
//! noise of 7 % a robot would be wrong by metres and say so.
//!
//! [`Ranging`] is a filter beside the estimator, in the sensor's driver. It carries a pose of its own, driven by the wheels, and `(s, o)`
//! of every pair, with all that they have in common. So ranges to three places or more, seen from a way that turns, teach what the radio
//! says too much, without a reference. [`Ranging::corrected`] is what is published: the range without it, the noise that is new in
//! every reading, and apart from that how well the correction is known, which stays.
//!
//! Correct a reading first and learn from it after that: no reading corrects itself.
#![forbid(unsafe_code)]

mod calibration;
mod ranging;

pub use calibration::{Calibration, Corrected};
pub use ranging::{Increment, Place, Ranging, Refused, Settings};

/// χ² with one degree of freedom, 99.9 %.
const CHI2_1_999: f64 = 10.827_566_170_662_733;
