//! What is known of a neighbour, seen from the observer.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use crate::sensor::MOST_SENSORS;

/// Numbers of a state: position, direction, and the slow errors of each sensor.
pub const SIZE: usize = 4 + 2 * MOST_SENSORS;

pub(crate) type Mean = SVector<f64, SIZE>;
pub(crate) type Covariance = SMatrix<f64, SIZE, SIZE>;

/// In what the neighbour's heading is.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Core {
    /// `(c, s) = (cos φ, sin φ)`, two free numbers: until it is known.
    #[default]
    Linear,
    /// φ \[rad\]
    Heading,
}

/// The neighbour i in the observer's body frame, and the slow errors of the observer's sensors.
///
/// All states lie in the same places: x and y in 0 and 1, c and s in 2 and 3 (φ in 2, and nothing in 3), the relative error of the
/// range and the error of the bearing of the k-th sensor that has slow errors in `4 + 2k` and `5 + 2k`. What is not there is zero.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct State {
    /// What is in 2 and 3.
    pub core: Core,
    /// How many sensors have slow errors.
    pub slow: usize,
    /// x
    pub mean: Mean,
    /// P
    pub covariance: Covariance,
}

impl Default for State {
    fn default() -> Self {
        Self {
            core: Core::default(),
            slow: 0,
            mean: Mean::zeros(),
            covariance: Covariance::zeros(),
        }
    }
}

/// Where the slow errors of the k-th sensor that has any are.
pub(crate) fn slow_at(k: usize) -> usize {
    4 + 2 * k
}

impl State {
    /// The places that are there, in their order.
    pub fn places(&self) -> impl Iterator<Item = usize> + use<> {
        let core = match self.core {
            Core::Linear => 4,
            Core::Heading => 3,
        };
        (0..core).chain(4..slow_at(self.slow))
    }

    /// The neighbour's position \[m\].
    #[must_use]
    pub fn position(&self) -> Vector2<f64> {
        self.mean.fixed_rows::<2>(0).into_owned()
    }

    /// `P_pp` \[m²\]
    #[must_use]
    pub fn position_covariance(&self) -> Matrix2<f64> {
        self.covariance.fixed_view::<2, 2>(0, 0).into_owned()
    }

    /// `√λ_max(P_pp)` \[m\]
    #[must_use]
    pub fn position_sigma(&self) -> f64 {
        let p = self.position_covariance();
        let (middle, half) = (0.5 * p.trace(), 0.5 * (p.m11 - p.m22));
        libm::sqrt(middle + libm::hypot(half, p.m12))
    }

    /// `e = (c, s)`
    pub(crate) fn direction(&self) -> Vector2<f64> {
        self.mean.fixed_rows::<2>(2).into_owned()
    }

    /// `P_ee`
    pub(crate) fn direction_covariance(&self) -> Matrix2<f64> {
        self.covariance.fixed_view::<2, 2>(2, 2).into_owned()
    }

    pub(crate) fn symmetrise(&mut self) {
        self.covariance = 0.5 * (self.covariance + self.covariance.transpose());
    }
}
