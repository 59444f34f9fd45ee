//! The floor: what the mathematics demands of the processor before any bookkeeping.
//!
//! Each function does the transcendental calls and square roots of one operation, on numbers of the right
//! size, and adds them up so that nothing can be left out.

use std::hint::black_box;

/// Propagation of both covariances: the sine and cosine of the heading, of three factor columns for each
/// covariance, and the three pivots of each Cholesky factor. (The noise enters linearly: its root is not needed.)
#[must_use]
pub fn propagate(heading_rad: f64, pivots: &[f64; 6]) -> f64 {
    let trig: f64 = pivots.iter().map(|&column| sine_cosine(column)).sum();
    sine_cosine(heading_rad) + trig + roots(pivots)
}

/// Conversion of a relative pose: the same angles and pivots as [`propagate`]; the sighting's own
/// noise adds three pivots.
#[must_use]
pub fn convert(heading_rad: f64, pivots: &[f64; 6], noise: &[f64; 3]) -> f64 {
    propagate(heading_rad, pivots) + roots(noise)
}

fn sine_cosine(angle_rad: f64) -> f64 {
    let (sine, cosine) = libm::sincos(black_box(angle_rad));
    sine + cosine
}

fn roots(values: &[f64]) -> f64 {
    values
        .iter()
        .map(|&value| libm::sqrt(black_box(value)))
        .sum()
}
