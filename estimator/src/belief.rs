//! What the robot believes: a pose and how well it knows it.

use core::fmt;

use crate::clip::positive_part;
use crate::covariance::Covariance3;
use crate::pose::Pose;

/// Pose with total covariance P and its independent part `P_i`; the dependent part is `P_d = P − P_i`.
///
/// Units: m², m·rad, rad².
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Belief {
    /// Mean.
    pub pose: Pose,
    /// P, symmetric positive semidefinite.
    pub total: Covariance3,
    /// `P_i`, symmetric positive semidefinite; zero is a normal state.
    pub independent: Covariance3,
}

/// Why something is not a belief.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum NotABelief {
    /// A coordinate is not a finite number.
    NotFinite,
    /// `P − P_i` has a negative eigenvalue.
    IndependentExceedsTotal,
}

impl fmt::Display for NotABelief {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a coordinate of the pose is not a finite number",
            Self::IndependentExceedsTotal => "the independent covariance exceeds the total",
        })
    }
}

impl core::error::Error for NotABelief {}

impl Belief {
    /// A belief that owes nothing to anybody: `P_i = P` (the initial state of Algorithm 4).
    #[must_use]
    pub fn independent(pose: Pose, covariance: Covariance3) -> Self {
        Self {
            pose,
            total: covariance,
            independent: covariance,
        }
    }

    /// A belief from outside: finite, and `P_i` a part of P.
    ///
    /// # Errors
    /// What it is not.
    pub fn new(
        pose: Pose,
        total: Covariance3,
        independent: Covariance3,
    ) -> Result<Self, NotABelief> {
        if !pose.is_finite() {
            return Err(NotABelief::NotFinite);
        }
        if !total.contains(&independent) {
            return Err(NotABelief::IndependentExceedsTotal);
        }
        Ok(Self {
            pose,
            total,
            independent,
        })
    }

    /// Makes P no smaller than its parts: `P := P_i + (P − P_i)⁺` where `P − P_i` has an eigenvalue below zero by more than
    /// rounding. The cubature transform, of P and `P_i` each by itself, comes to that where the heading is uncertain; what
    /// is fused is always the two parts, so this only says what is meant.
    #[inline]
    pub fn keep_parts(&mut self) {
        if !self.total.contains(&self.independent) {
            self.total = self.total_of_parts();
        }
    }

    #[cold]
    fn total_of_parts(&self) -> Covariance3 {
        let (total, independent) = (self.total.symmetric(), self.independent.symmetric());
        Covariance3::trusted(&(independent + positive_part(&(total - independent))))
    }

    /// Whether the pose and all variances are numbers.
    #[must_use]
    #[inline]
    pub(crate) fn is_finite(&self) -> bool {
        let ([a, b, c], [d, e, f]) = (self.total.variances(), self.independent.variances());
        let Pose { x, y, phi } = self.pose;
        let all = [a, b, c, d, e, f, x, y, phi];
        all.iter().sum::<f64>().is_finite()
    }

    /// Everything that was known is now shared: `P_i := 0` (Algorithm 4, line 19).
    pub fn make_dependent(&mut self) {
        self.independent = Covariance3::ZERO;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::{Motion, propagate};

    fn diagonal(variances: [f64; 3]) -> Covariance3 {
        Covariance3::diagonal(variances).unwrap()
    }

    #[test]
    fn a_belief_from_outside_is_one_or_is_refused() {
        let (pose, total) = (Pose::new(1.0, 2.0, 3.0), diagonal([0.1, 0.2, 0.3]));
        assert!(Belief::new(pose, total, total).is_ok());
        let nowhere = Pose {
            x: f64::NAN,
            ..pose
        };
        assert_eq!(
            Belief::new(nowhere, total, total),
            Err(NotABelief::NotFinite)
        );
        let more = diagonal([0.1, 0.2001, 0.3]);
        assert_eq!(
            Belief::new(pose, total, more),
            Err(NotABelief::IndependentExceedsTotal)
        );
    }

    /// The points on a heading known to 1 rad turn by more than a right angle: less of their sine is across.
    #[test]
    fn parts_that_the_cubature_made_larger_than_the_whole_are_kept() {
        let belief = Belief {
            pose: Pose::default(),
            total: diagonal([1e-4, 1e-4, 1.0]),
            independent: diagonal([1e-4, 1e-4, 0.49]),
        };
        let noise = diagonal([0.0; 3]);
        let moved = propagate(
            &belief,
            &Motion::Holonomic {
                velocity: [1.0, 0.0, 0.0],
                noise,
            },
            1.0,
        );
        assert!(!moved.total.contains(&moved.independent), "the case is one");
        let mut kept = moved;
        kept.keep_parts();
        assert!(kept.total.contains(&kept.independent) && kept.total.contains(&moved.total));
        assert_eq!(
            (kept.pose, kept.independent),
            (moved.pose, moved.independent)
        );
        let once = kept;
        kept.keep_parts();
        assert_eq!(kept, once);
    }

    #[test]
    fn what_is_sound_is_left_alone_to_the_bit() {
        let total = Covariance3::from_row_major([0.1, 0.03, 0.0, 0.03, 0.1, 0.01, 0.0, 0.01, 0.3]);
        for part in [0.0, 1.0 / 3.0, 1.0] {
            let belief = Belief {
                independent: total.unwrap().scaled(part),
                total: total.unwrap(),
                pose: Pose::default(),
            };
            let mut kept = belief;
            kept.keep_parts();
            assert_eq!(kept, belief);
        }
    }
}
