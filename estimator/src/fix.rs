//! The position fix: a Kalman update with `H = [I₂ 0]` \[38, 39\].

use crate::belief::Belief;
use crate::covariance::{Covariance2, Covariance3};
use crate::factor::Factor;
use crate::gate::accepts;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::symmetric::{Square3, Symmetric3};

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

/// `own` after a fix at `position` \[m\] with noise `covariance` (`R_A`, m²), if d² ≤ `gate` (χ², two degrees of
/// freedom; infinite accepts everything).
///
/// The gate uses `H P Hᵀ + R_A`; both parts are updated in Joseph's form with the gain of P, and the bend shrinks
/// ([`crate::honest`]).
#[must_use]
pub fn update(own: &Belief, position: [f64; 2], covariance: &Covariance2, gate: f64) -> FixUpdate {
    let noise = embedded(covariance);
    let total = own.total().symmetric();
    let innovation_inverse = Factor::new(&(position_block(&total) + noise)).inverse();
    let innovation = [position[0] - own.pose.x, position[1] - own.pose.y, 0.0];
    let d2 = innovation_inverse.quadratic(innovation);
    let refused = FixUpdate {
        belief: *own,
        accepted: false,
        d2,
    };
    if !accepts(d2, gate) {
        return refused;
    }
    let belief = updated(own, innovation, &total.times(&innovation_inverse), &noise);
    if !belief.is_finite() {
        return refused;
    }
    FixUpdate {
        belief,
        accepted: true,
        d2,
    }
}

/// With the gain W: `P_i⁺ = (I − W) P_i (I − W)ᵀ + W R Wᵀ`, `P_d⁺ = (I − W) P_d (I − W)ᵀ`.
#[inline]
fn updated(own: &Belief, innovation: [f64; 3], gain: &Square3, noise: &Symmetric3) -> Belief {
    let [dx, dy, dphi] = gain.apply(innovation);
    let complement = gain.complement();
    let left = |part: &Covariance3| complement.congruence(&part.symmetric());
    let independent = left(&own.parts.independent) + gain.congruence(noise);
    let mut belief = Belief {
        pose: Pose::new(own.pose.x + dx, own.pose.y + dy, own.pose.phi + dphi),
        parts: Parts {
            independent: Covariance3::trusted(&independent),
            dependent: Covariance3::trusted(&left(&own.parts.dependent)),
        },
        bend: own.bend,
    };
    let (before, after) = (own.heading_variance(), belief.heading_variance());
    belief.bend = own.bend.measured(&complement, before, after);
    belief
}

/// `Hᵀ A H`: with zeros for the heading, the 2×2 algebra is that of 3×3 matrices (the inverse is the generalised
/// one, so `P (Hᵀ S H)⁻` is `[K 0]`).
fn embedded(a: &Covariance2) -> Symmetric3 {
    let a = a.matrix();
    Symmetric3 {
        xx: a.m11,
        xy: a.m21,
        yy: a.m22,
        ..Symmetric3::default()
    }
}

/// `Hᵀ H P Hᵀ H`
fn position_block(p: &Symmetric3) -> Symmetric3 {
    Symmetric3 {
        xx: p.xx,
        xy: p.xy,
        yy: p.yy,
        ..Symmetric3::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn belief() -> Belief {
        let p = [0.04, 0.006, 0.002, 0.006, 0.09, -0.003, 0.002, -0.003, 0.01];
        Belief::independent(
            Pose::new(1.0, 2.0, 0.5),
            Covariance3::from_row_major(p).unwrap(),
        )
    }

    #[test]
    fn a_refused_fix_changes_nothing() {
        let noise = Covariance2::diagonal([0.01; 2]).unwrap();
        let refused = update(&belief(), [3.0, 2.0], &noise, crate::gate::CHI2_2_99);
        assert!(!refused.accepted && refused.d2 > 80.0);
        assert_eq!(refused.belief, belief());
        assert!(!update(&belief(), [f64::NAN, 2.0], &noise, f64::INFINITY).accepted);
    }

    #[test]
    fn a_perfect_fix_is_believed() {
        let told = update(&belief(), [1.1, 1.9], &Covariance2::ZERO, f64::INFINITY).belief;
        assert!((told.pose.x - 1.1).abs() < 1e-15 && (told.pose.y - 1.9).abs() < 1e-15);
        let [xx, yy, pp] = told.total().variances();
        assert!(xx.abs() < 1e-17 && yy.abs() < 1e-17);
        assert!(pp > 0.0 && pp < 0.01);
    }

    #[test]
    fn certainty_learns_nothing() {
        let certain = Belief::independent(Pose::new(1.0, 2.0, 0.5), Covariance3::ZERO);
        let told = update(&certain, [1.0, 2.0], &Covariance2::ZERO, 1.0);
        assert_eq!((told.accepted, told.belief), (true, certain));
    }
}
