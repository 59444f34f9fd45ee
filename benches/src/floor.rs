//! The floor: what the mathematics demands of the processor before any bookkeeping.
//!
//! The function does the transcendental calls of one operation, on numbers of the right
//! size, and adds them up so that nothing can be left out.

use std::hint::black_box;

/// Propagation: the sine and cosine of the heading, and two exponentials: of the heading's variance and of the turn's noise.
#[must_use]
pub fn propagate(heading_rad: f64, variances: [f64; 2]) -> f64 {
    let fallen: f64 = variances
        .iter()
        .map(|&variance| libm::expm1(black_box(-0.5 * variance)))
        .sum();
    sine_cosine(heading_rad) + fallen
}

fn sine_cosine(angle_rad: f64) -> f64 {
    let (sine, cosine) = libm::sincos(black_box(angle_rad));
    sine + cosine
}
