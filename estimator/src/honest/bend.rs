//! How the distribution's bend lies to the direction.

use super::circle::Circle;
use crate::covariance::Covariance3;
use crate::symmetric::Symmetric3;

/// `K_H = [k_a k_b] R(φ̄)ᵀ`: the covariance of `[x, y, φ]` with what is not linear in φ of the direction, along and across
/// the mean heading \[m, m, rad\].
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Bend {
    /// `k_a`
    pub along: [f64; 3],
    /// `k_b`
    pub across: [f64; 3],
}

impl Bend {
    /// Straight: as a Gaussian is.
    pub const ZERO: Self = Self {
        along: [0.0; 3],
        across: [0.0; 3],
    };

    /// The six numbers, `k_a` before `k_b`.
    #[must_use]
    pub fn to_array(&self) -> [f64; 6] {
        let ([a, b, c], [d, e, f]) = (self.along, self.across);
        [a, b, c, d, e, f]
    }

    /// Of [`Self::to_array`].
    #[must_use]
    pub fn from_array([a, b, c, d, e, f]: [f64; 6]) -> Self {
        Self {
            along: [a, b, c],
            across: [d, e, f],
        }
    }

    /// `k_a k_aᵀ/Ω_a + k_b k_bᵀ/Ω_b`: as much of the covariance as the direction explains beyond what is linear, where the
    /// heading's variance is `s` \[rad²\].
    pub(crate) fn covariance(&self, s: f64) -> Covariance3 {
        let circle = Circle::of(s, 0.0);
        let explained = |k: [f64; 3], variance: f64| {
            let is_straight = k.iter().all(|it| *it == 0.0);
            let weight = if is_straight { 0.0 } else { 1.0 / variance };
            Symmetric3::outer(weight, k)
        };
        let (along, across) = (
            explained(self.along, circle.along),
            explained(self.across, circle.across),
        );
        Covariance3::trusted(&(along + across))
    }

    /// Column by column.
    #[inline]
    pub(crate) fn mapped(&self, map: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        Self {
            along: map(self.along),
            across: map(self.across),
        }
    }

    /// A number that is finite if all are.
    #[inline]
    pub(crate) fn sum(&self) -> f64 {
        let ([a, b, c], [d, e, f]) = (self.along, self.across);
        (a + b + c) + (d + e + f)
    }
}
