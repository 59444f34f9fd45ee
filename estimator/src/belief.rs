//! What the robot believes: a pose and how well it knows it.

use core::fmt;

use crate::covariance::Covariance3;
use crate::honest::Bend;
use crate::parts::Parts;
use crate::pose::Pose;

/// Pose, its covariance in two parts, `P = P_i + P_d`, and the bend of its distribution.
///
/// Units: m², m·rad, rad².
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Belief {
    /// Mean.
    pub pose: Pose,
    /// `P_i` and `P_d`; that either is zero is a normal state.
    pub parts: Parts,
    /// `K_H`, zero for a Gaussian.
    pub bend: Bend,
}

/// Why something is not a belief.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum NotABelief {
    /// A coordinate is not a finite number.
    NotFinite,
    /// `P_i` or `P_d` has a negative eigenvalue, or `P_d − k_a k_aᵀ/Ω_a − k_b k_bᵀ/Ω_b` has: so much bend it cannot hold.
    BendExceedsDependent,
}

impl fmt::Display for NotABelief {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a coordinate of the pose is not a finite number",
            Self::BendExceedsDependent => "its bend is more than its dependent covariance holds",
        })
    }
}

impl core::error::Error for NotABelief {}

impl Belief {
    /// A Gaussian that owes nothing to anybody: `P_i = P` (the initial state of Algorithm 4).
    #[must_use]
    pub fn independent(pose: Pose, covariance: Covariance3) -> Self {
        Self::gaussian(pose, Parts::independent(covariance))
    }

    /// A belief without a bend.
    #[must_use]
    pub fn gaussian(pose: Pose, parts: Parts) -> Self {
        Self {
            pose,
            parts,
            bend: Bend::ZERO,
        }
    }

    /// A belief from outside: finite, and its bend no more than `P_d` holds.
    ///
    /// # Errors
    /// What it is not.
    pub fn new(pose: Pose, parts: Parts, bend: Bend) -> Result<Self, NotABelief> {
        let belief = Self { pose, parts, bend };
        if !(pose.is_finite() && belief.is_finite()) {
            return Err(NotABelief::NotFinite);
        }
        let heading = belief.heading_variance();
        let holds = parts.dependent.contains(&bend.covariance(heading));
        holds
            .then_some(belief)
            .ok_or(NotABelief::BendExceedsDependent)
    }

    /// P
    #[must_use]
    pub fn total(&self) -> Covariance3 {
        self.parts.total()
    }

    /// `P_φφ` \[rad²\].
    #[inline]
    pub(crate) fn heading_variance(&self) -> f64 {
        self.parts.independent.symmetric().pp + self.parts.dependent.symmetric().pp
    }

    /// Whether the pose, all variances and the bend are numbers.
    #[must_use]
    #[inline]
    pub(crate) fn is_finite(&self) -> bool {
        let [a, b, c] = self.parts.independent.variances();
        let [d, e, f] = self.parts.dependent.variances();
        let Pose { x, y, phi } = self.pose;
        let all = [a, b, c, d, e, f, x, y, phi, self.bend.sum()];
        all.iter().sum::<f64>().is_finite()
    }

    /// Everything that was known is now shared: `P_d := P`, `P_i := 0` (Algorithm 4, line 19). The bend stays.
    pub fn make_dependent(&mut self) {
        self.parts = Parts::dependent(self.total());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagonal(variances: [f64; 3]) -> Covariance3 {
        Covariance3::diagonal(variances).unwrap()
    }

    #[test]
    fn a_belief_from_outside_is_one_or_is_refused() {
        let (pose, part) = (Pose::new(1.0, 2.0, 3.0), diagonal([0.1, 0.2, 0.3]));
        let parts = Parts {
            independent: part,
            dependent: part,
        };
        assert!(Belief::new(pose, parts, Bend::ZERO).is_ok());
        let nowhere = Pose {
            x: f64::NAN,
            ..pose
        };
        assert_eq!(
            Belief::new(nowhere, parts, Bend::ZERO),
            Err(NotABelief::NotFinite)
        );
        let bent = |x: f64| Bend {
            along: [x, 0.0, 0.0],
            across: [0.0; 3],
        };
        assert!(Belief::new(pose, parts, bent(0.1)).is_ok());
        assert_eq!(
            Belief::new(pose, parts, bent(0.2)), // Ω_a is ½ (1 − exp(−0.6))² = 0.102.
            Err(NotABelief::BendExceedsDependent)
        );
        assert_eq!(
            Belief::new(pose, parts, bent(f64::NAN)),
            Err(NotABelief::NotFinite)
        );
    }

    #[test]
    fn who_knows_the_heading_exactly_has_no_bend() {
        let parts = Parts::dependent(diagonal([1.0, 1.0, 0.0]));
        let bend = Bend {
            along: [0.0; 3],
            across: [0.0, 1e-3, 0.0],
        };
        assert_eq!(
            Belief::new(Pose::default(), parts, bend),
            Err(NotABelief::BendExceedsDependent)
        );
    }

    #[test]
    fn what_becomes_dependent_keeps_its_bend() {
        let bend = Bend {
            along: [0.01, 0.0, 0.0],
            across: [0.0, 0.02, 0.0],
        };
        let parts = Parts {
            independent: diagonal([1.0, 2.0, 3.0]),
            dependent: diagonal([4.0, 5.0, 6.0]),
        };
        let mut belief = Belief::new(Pose::default(), parts, bend).unwrap();
        belief.make_dependent();
        assert_eq!(belief.parts, Parts::dependent(diagonal([5.0, 7.0, 9.0])));
        assert_eq!(belief.bend, bend);
    }
}
