//! Symmetric 2×2 matrices, and what becomes of those of a pose where only a part of it is seen.

use core::ops::{Add, Mul};

use crate::covariance::Covariance2;
use crate::factor::{Factor, pivot};
use crate::symmetric::Symmetric3;

/// A determinant beyond this part of the diagonal's product has lost no digits that matter.
const REGULAR: f64 = 1e-6;

/// Determinants whose squares, times a variance of their scale, neither overflow nor vanish.
const HARMLESS: core::ops::Range<f64> = 1e-60..1e60;

/// A symmetric 2×2 matrix, its lower triangle.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Symmetric2 {
    pub(super) xx: f64,
    pub(super) xy: f64,
    pub(super) yy: f64,
}

impl Symmetric2 {
    pub(super) const ZERO: Self = Self {
        xx: 0.0,
        xy: 0.0,
        yy: 0.0,
    };

    /// `w · c cᵀ`
    #[inline]
    pub(super) fn outer(w: f64, [x, y]: [f64; 2]) -> Self {
        let (wx, wy) = (w * x, w * y);
        Self {
            xx: wx * x,
            xy: wx * y,
            yy: wy * y,
        }
    }

    #[inline]
    pub(super) fn of(covariance: &Covariance2) -> Self {
        let m = covariance.matrix();
        Self {
            xx: m.m11,
            xy: m.m21,
            yy: m.m22,
        }
    }

    #[inline]
    pub(super) fn covariance(&self) -> Covariance2 {
        Covariance2::trusted(self.xx, self.xy, self.yy)
    }

    /// The block of the position.
    #[inline]
    pub(super) fn of_position(p: &Symmetric3) -> Self {
        Self {
            xx: p.xx,
            xy: p.xy,
            yy: p.yy,
        }
    }

    /// `H P Hᵀ`, a sum of squares.
    #[inline]
    pub(super) fn seen(h: &[[f64; 3]; 2], p: &Symmetric3) -> Self {
        let Factor {
            lower: [l21, l31, l32],
            pivots: [d1, d2, d3],
            ..
        } = Factor::new(p);
        Self::outer(d1, apply(h, [1.0, l21, l31]))
            + Self::outer(d2, apply(h, [0.0, 1.0, l32]))
            + Self::outer(d3, apply(h, [0.0, 0.0, 1.0]))
    }

    /// `A = Σ d c cᵀ`: two d, each with its c.
    #[inline]
    pub(super) fn columns(&self) -> [(f64, [f64; 2]); 2] {
        let (d1, r1) = pivot(self.xx, self.xx);
        let l = self.xy * r1;
        let (d2, _) = pivot(self.yy - l * self.xy, self.yy);
        [(d1, [1.0, l]), (d2, [0.0, 1.0])]
    }

    /// `C A Cᵀ`, of a C that turns, a sum of squares.
    #[inline]
    pub(super) fn turned(&self, sin: f64, cos: f64) -> Self {
        let [(d1, [_, l]), (d2, _)] = self.columns();
        Self::outer(d1, [cos - sin * l, sin + cos * l]) + Self::outer(d2, [-sin, cos])
    }

    /// `J A Jᵀ`
    #[inline]
    pub(super) fn across(&self) -> Self {
        Self {
            xx: self.yy,
            xy: -self.xy,
            yy: self.xx,
        }
    }

    /// `A⁻¹`; of a singular A a generalised inverse.
    #[inline]
    pub(super) fn inverse(&self) -> Self {
        let (_, r1) = pivot(self.xx, self.xx);
        let l = self.xy * r1;
        let (_, r2) = pivot(self.yy - l * self.xy, self.yy);
        Self {
            xx: r1 + l * l * r2,
            xy: -l * r2,
            yy: r2,
        }
    }

    /// A multiple of the inverse, and of what: a regular matrix needs no division for it.
    #[inline]
    pub(super) fn up_to_scale(&self) -> (Self, f64) {
        let square = self.xx * self.yy;
        let determinant = square - self.xy * self.xy;
        if determinant > REGULAR * square && HARMLESS.contains(&determinant) {
            return (
                Self {
                    xx: self.yy,
                    xy: -self.xy,
                    yy: self.xx,
                },
                determinant,
            );
        }
        (self.inverse(), 1.0)
    }

    #[inline]
    pub(super) fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.xx * x + self.xy * y, self.xy * x + self.yy * y]
    }

    /// `vᵀ A v`
    #[inline]
    pub(super) fn quadratic(&self, v: [f64; 2]) -> f64 {
        self.bilinear(v, v)
    }

    /// `A B A`
    #[inline]
    pub(super) fn congruence(&self, b: &Self) -> Self {
        let (x, y) = (self.apply([b.xx, b.xy]), self.apply([b.xy, b.yy])); // The columns of A B.
        Self {
            xx: self.xx * x[0] + self.xy * y[0],
            xy: self.xy * x[0] + self.yy * y[0],
            yy: self.xy * x[1] + self.yy * y[1],
        }
    }

    /// `tr A B`
    #[inline]
    pub(super) fn product_trace(&self, b: &Self) -> f64 {
        self.xx * b.xx + 2.0 * self.xy * b.xy + self.yy * b.yy
    }

    /// `vᵀ A u`
    #[inline]
    pub(super) fn bilinear(&self, v: [f64; 2], u: [f64; 2]) -> f64 {
        let [x, y] = self.apply(u);
        v[0] * x + v[1] * y
    }

    #[inline]
    pub(super) fn is_zero(&self) -> bool {
        *self == Self::ZERO
    }
}

/// `H v`
#[inline]
pub(super) fn apply(h: &[[f64; 3]; 2], v: [f64; 3]) -> [f64; 2] {
    h.map(|[x, y, p]| x * v[0] + y * v[1] + p * v[2])
}

impl Add for Symmetric2 {
    type Output = Self;
    #[inline]
    fn add(self, b: Self) -> Self {
        Self {
            xx: self.xx + b.xx,
            xy: self.xy + b.xy,
            yy: self.yy + b.yy,
        }
    }
}

impl Mul<f64> for Symmetric2 {
    type Output = Self;
    #[inline]
    fn mul(self, w: f64) -> Self {
        Self {
            xx: w * self.xx,
            xy: w * self.xy,
            yy: w * self.yy,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_singular_matrix_has_an_inverse_in_its_range() {
        for c in [[1.0, 2.0], [0.0, 3.0], [2.0, 0.0], [1.0, 1e-9]] {
            let a = Symmetric2::outer(2.0, c);
            let there_and_back = a.apply(a.inverse().apply(a.apply(c)));
            let expected = a.apply(c);
            for i in 0..2 {
                assert!(
                    (there_and_back[i] - expected[i]).abs() < 1e-12 * (1.0 + expected[i].abs())
                );
            }
        }
        assert!(Symmetric2::ZERO.inverse().is_zero());
    }

    #[test]
    fn what_is_turned_by_a_right_angle_is_across() {
        let a = Symmetric2::outer(2.0, [1.0, 0.3]) + Symmetric2::outer(0.1, [0.0, 1.0]);
        let (turned, across) = (a.turned(1.0, 0.0), a.across());
        assert!((turned.xx - across.xx).abs() < 1e-15);
        assert!((turned.xy - across.xy).abs() < 1e-15);
        assert!((turned.yy - across.yy).abs() < 1e-15);
    }
}
