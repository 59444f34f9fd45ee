//! The square-root-free factor `A = L D Lᵀ` of a symmetric positive semidefinite 3×3 matrix.
//!
//! It is the lower Cholesky factor `S = L √D` of the cubature transform \[6\] with its columns' scale kept
//! apart, and gives the inverse without a square root. A singular matrix is legal: a pivot that is no more than
//! 1e-14 of its diagonal entry is rounding, and its column is zero.

use crate::symmetric::Symmetric3;

/// A pivot up to this part of its diagonal entry counts as zero.
pub(crate) const RELATIVE: f64 = 1e-14;

/// A pivot below this counts as zero: 1e-50 m is no distance, and its reciprocal must stay finite.
pub(crate) const ABSOLUTE: f64 = 1e-100;

/// Rounding may have taken this part of a diagonal entry from its pivot.
const LOST: f64 = 2e-15;

/// A matrix whose pivots all exceed this part of their diagonal entries is far from singular.
const REGULAR: f64 = 1e-6;

/// `L` (unit lower triangular) and the diagonal of `D`, with its reciprocals.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Factor {
    /// Below the diagonal of `L`: `[l21, l31, l32]`.
    pub(crate) lower: [f64; 3],
    /// `D`, entries ≥ 0.
    pub(crate) pivots: [f64; 3],
    /// `1/D`, zero where `D` is.
    reciprocals: [f64; 3],
}

impl Factor {
    /// Factors `a`, order x, y, φ.
    #[inline]
    pub(crate) fn new(a: &Symmetric3) -> Self {
        let (d1, r1) = pivot(a.xx, a.xx);
        let (l21, l31) = (a.xy * r1, a.xp * r1);
        let (d2, r2) = pivot(a.yy - l21 * a.xy, a.yy);
        let rest = a.yp - l31 * a.xy;
        let l32 = rest * r2;
        let (d3, r3) = pivot(a.pp - l31 * a.xp - l32 * rest, a.pp);
        Self {
            lower: [l21, l31, l32],
            pivots: [d1, d2, d3],
            reciprocals: [r1, r2, r3],
        }
    }

    /// `A⁻¹`; of a singular `A` a generalised inverse, `A A⁻ A = A`.
    #[inline]
    pub(crate) fn inverse(&self) -> Symmetric3 {
        let [l21, l31, l32] = self.lower;
        let [r1, r2, r3] = self.reciprocals;
        let m31 = l21 * l32 - l31; // L⁻¹ has −l21, m31, −l32 below its diagonal.
        let (r2m21, r3m31, r3m32) = (-r2 * l21, r3 * m31, -r3 * l32);
        Symmetric3 {
            xx: r1 - r2m21 * l21 + r3m31 * m31,
            xy: r2m21 + r3m32 * m31,
            xp: r3m31,
            yy: r2 - r3m32 * l32,
            yp: r3m32,
            pp: r3,
        }
    }

    /// `D^(−½) L⁻¹ v` of a v in the plane: its covariance is one where that of v is A.
    #[inline]
    pub(crate) fn normalised(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([l21, ..], [r1, r2, _]) = (self.lower, self.reciprocals);
        [libm::sqrt(r1) * x, libm::sqrt(r2) * (y - l21 * x)]
    }

    /// `vᵀ A⁻¹ v`
    #[inline]
    pub(crate) fn distance(&self, [x, y, p]: [f64; 3]) -> f64 {
        let ([l21, l31, l32], [r1, r2, r3]) = (self.lower, self.reciprocals);
        let second = y - l21 * x;
        let third = p - l31 * x - l32 * second;
        r1 * (x * x) + r2 * (second * second) + r3 * (third * third)
    }

    /// `[y_1, y_2, y_3]` of `v = L y`, for a v whose square is no more than A holds: of each coordinate what is left of it when its
    /// pivot has lost to rounding what it may have lost.
    #[inline]
    pub(crate) fn held(&self, a: &Symmetric3, [x, y, p]: [f64; 3]) -> [f64; 3] {
        let ([l21, l31, l32], [d1, d2, d3]) = (self.lower, self.pivots);
        let [r1, r2, r3] = self.reciprocals;
        let second = y - l21 * x;
        let third = p - l31 * x - l32 * second;
        let held = |pivot: f64, reciprocal: f64, diagonal: f64| {
            (pivot - LOST * diagonal).max(0.0) * reciprocal
        };
        [
            held(d1, r1, a.xx) * x,
            held(d2, r2, a.yy) * second,
            held(d3, r3, a.pp) * third,
        ]
    }

    /// `vᵀ A⁻¹ v` of `v = L y`.
    #[inline]
    pub(crate) fn explained(&self, [x, y, p]: [f64; 3]) -> f64 {
        let [r1, r2, r3] = self.reciprocals;
        x * x * r1 + y * y * r2 + p * p * r3
    }

    /// Whether each coordinate of `a`, the matrix that was factored, keeps some of its variance once those before
    /// it are known: well above rounding.
    pub(crate) fn is_regular(&self, a: &Symmetric3) -> bool {
        let [d1, d2, d3] = self.pivots;
        d1 > 0.0 && d2 > REGULAR * a.yy && d3 > REGULAR * a.pp
    }
}

/// The pivot and its reciprocal, both zero if it is rounding of `diagonal`. What is no number stays none: taken for zero, it
/// would be certainty.
#[inline]
pub(crate) fn pivot(d: f64, diagonal: f64) -> (f64, f64) {
    if d <= RELATIVE * diagonal || d <= ABSOLUTE {
        (0.0, 0.0)
    } else {
        (d, 1.0 / d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_regular_matrix_is_inverted() {
        let a = Symmetric3 {
            xx: 4.0,
            xy: 1.0,
            xp: -2.0,
            yy: 3.0,
            yp: 0.5,
            pp: 5.0,
        };
        let product = a.times(&Factor::new(&a).inverse()).0;
        for (i, row) in product.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                assert!((entry - if i == j { 1.0 } else { 0.0 }).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_rank_one_matrix_has_one_column_and_a_generalised_inverse() {
        let a = Symmetric3::outer(2.0, [1.0, -3.0, 0.5]);
        let factor = Factor::new(&a);
        assert_eq!(factor.pivots, [2.0, 0.0, 0.0]);
        let gain = a.times(&factor.inverse());
        assert_eq!(gain.congruence(&a), a); // (A A⁻) A (A A⁻)ᵀ
    }

    #[test]
    fn what_is_no_number_is_not_taken_for_zero() {
        let nothing = Symmetric3 {
            yy: f64::NAN,
            ..Symmetric3::outer(1.0, [1.0, 0.0, 0.0])
        };
        assert!(
            Factor::new(&nothing)
                .inverse()
                .quadratic([0.0, 1.0, 0.0])
                .is_nan()
        );
    }

    #[test]
    fn zero_is_its_own_factor_and_inverse() {
        let factor = Factor::new(&Symmetric3::default());
        assert_eq!(factor.pivots, [0.0; 3]);
        assert_eq!(factor.inverse(), Symmetric3::default());
    }
}
