//! What the robot believes: a pose and how well it knows it.

use nalgebra::Matrix3;

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

    /// `P_d = P − P_i`, symmetric; rounding may leave eigenvalues a little below zero.
    #[must_use]
    pub fn dependent(&self) -> Matrix3<f64> {
        self.total.matrix() - self.independent.matrix()
    }

    /// Everything that was known is now shared: `P_i := 0` (Algorithm 4, line 19).
    pub fn make_dependent(&mut self) {
        self.independent = Covariance3::ZERO;
    }
}
