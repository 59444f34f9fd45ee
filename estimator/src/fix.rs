//! The position fix: a Kalman update with `H = [I₂ 0]` \[38, 39\].

use crate::belief::Belief;
use crate::covariance::{Covariance2, Covariance3};
use crate::factor::Factor;
use crate::gate::accepts;
use crate::honest;
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
    judged(own, position, covariance, gate).0
}

/// [`update`], and the innovation with a covariance of one where all is as it is said to be.
#[inline]
pub(crate) fn judged(
    own: &Belief,
    position: [f64; 2],
    covariance: &Covariance2,
    gate: f64,
) -> (FixUpdate, [f64; 2]) {
    let total = own.total().symmetric();
    let factor = Factor::new(&innovation_covariance(&total, covariance));
    let inverse = factor.inverse();
    let innovation = [position[0] - own.pose.x, position[1] - own.pose.y];
    let normalised = factor.normalised(innovation);
    let d2 = inverse.quadratic([innovation[0], innovation[1], 0.0]);
    let refused = FixUpdate {
        belief: *own,
        accepted: false,
        d2,
    };
    if !accepts(d2, gate) {
        return (refused, normalised);
    }
    let belief = Gain::new(&total, &inverse).update(own, innovation, covariance);
    if !belief.is_finite() {
        return (refused, normalised);
    }
    let accepted = FixUpdate {
        belief,
        accepted: true,
        d2,
    };
    (accepted, normalised)
}

/// `I − W H` of a fix with noise `covariance`.
pub(crate) fn complement(own: &Belief, covariance: &Covariance2) -> Square3 {
    let total = own.total().symmetric();
    let inverse = Factor::new(&innovation_covariance(&total, covariance)).inverse();
    Gain::new(&total, &inverse).complement()
}

/// `S = H P Hᵀ + R_A`. With zeros for the heading, its generalised inverse is that of the 2×2 matrix.
#[inline]
fn innovation_covariance(p: &Symmetric3, noise: &Covariance2) -> Symmetric3 {
    let noise = noise.matrix();
    Symmetric3 {
        xx: p.xx + noise.m11,
        yy: p.yy + noise.m22,
        xy: p.xy + noise.m21,
        ..Symmetric3::ZERO
    }
}

/// `W = P Hᵀ S⁻¹`, 3×2.
struct Gain([[f64; 2]; 3]);

impl Gain {
    #[inline]
    fn new(p: &Symmetric3, inverse: &Symmetric3) -> Self {
        let Symmetric3 { xx, xy, yy, .. } = *inverse;
        let row = |[x, y]: [f64; 2]| [x * xx + y * xy, x * xy + y * yy];
        Self([row([p.xx, p.xy]), row([p.xy, p.yy]), row([p.xp, p.yp])])
    }

    /// `W v`
    #[inline]
    fn apply(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        self.0.map(|[wx, wy]| wx * x + wy * y)
    }

    /// `I − W H`
    #[inline]
    fn complement(&self) -> Square3 {
        let [[xx, xy], [yx, yy], [px, py]] = self.0;
        Square3([[1.0 - xx, -xy, 0.0], [-yx, 1.0 - yy, 0.0], [-px, -py, 1.0]])
    }

    /// `W R Wᵀ`
    #[inline]
    fn brought(&self, noise: &Covariance2) -> Symmetric3 {
        let noise = noise.matrix();
        let Factor {
            lower: [l21, ..],
            pivots: [d1, d2, _],
            ..
        } = Factor::new(&Symmetric3 {
            xx: noise.m11,
            yy: noise.m22,
            xy: noise.m21,
            ..Symmetric3::ZERO
        });
        Symmetric3::outer(d1, self.apply([1.0, l21]))
            + Symmetric3::outer(d2, self.apply([0.0, 1.0]))
    }

    /// `P_i⁺ = (I − W H) P_i (I − W H)ᵀ + W R Wᵀ`, `P_d⁺ = (I − W H) P_d (I − W H)ᵀ`.
    #[inline]
    fn update(&self, own: &Belief, innovation: [f64; 2], noise: &Covariance2) -> Belief {
        let [dx, dy, dphi] = self.apply(innovation);
        let Pose { x, y, phi } = own.pose;
        let complement = self.complement();
        let independent =
            complement.congruence(&own.parts.independent.symmetric()) + self.brought(noise);
        let dependent = own.parts.dependent.symmetric();
        let (dependent, bend) = honest::left(&dependent, &own.bend, &complement);
        let after = independent.pp + dependent.pp;
        Belief {
            pose: Pose::new(x + dx, y + dy, phi + dphi),
            parts: Parts {
                independent: Covariance3::trusted(&independent),
                dependent: Covariance3::trusted(&dependent),
            },
            bend: bend.shrunk(own.heading_variance(), after),
        }
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
