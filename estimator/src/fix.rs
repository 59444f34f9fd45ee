//! The position fix: a Kalman update with `H = [I₂ 0]` \[38, 39\].

use crate::belief::Belief;
use crate::covariance::Covariance2;

/// Result of [`update`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct FixUpdate {
    /// The belief afterwards; the one before, bit for bit, if the gate refused.
    pub belief: Belief,
    /// Whether the fix passed the gate.
    pub accepted: bool,
    /// Normalised innovation squared.
    pub d2: f64,
}

/// `own` after a fix at `position` \[m\] with noise `covariance` (R_A, m²), if d² ≤ `gate`.
#[must_use]
pub fn update(own: &Belief, position: [f64; 2], covariance: &Covariance2, gate: f64) -> FixUpdate {
    let _ = (own, position, covariance, gate);
    unimplemented!()
}
