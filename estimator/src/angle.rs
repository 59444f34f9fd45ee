//! Headings on the circle.

use core::f64::consts::{PI, TAU};

/// `a` modulo 2π in (−π, π]: `a − 2π ⌈(a − π)/2π⌉`.
///
/// Innovations and stored headings are wrapped; cubature points and their means never are.
#[must_use]
pub fn wrap(a: f64) -> f64 {
    if a > -PI && a <= PI {
        return a; // Exact, where the formula would round.
    }
    a - TAU * libm::ceil((a - PI) / TAU)
}
