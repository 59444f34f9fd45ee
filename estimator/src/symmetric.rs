//! 3×3 matrices as six or nine numbers: what the algorithms compute with between two [`crate::Covariance3`].

use core::ops::{Add, Mul, Sub};

use crate::factor::Factor;

/// A symmetric 3×3 matrix over `[x, y, φ]`, its lower triangle; `p` stands for φ. What undergoes the same lies side by side:
/// the compiler makes one instruction of two.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Symmetric3 {
    pub(crate) xx: f64,
    pub(crate) yy: f64,
    pub(crate) xp: f64,
    pub(crate) yp: f64,
    pub(crate) xy: f64,
    pub(crate) pp: f64,
}

/// `G L` of a positive semidefinite `A = L D Lᵀ`. `G A Gᵀ` is made of it, a sum of squares: in the plain product terms cancel where G
/// takes A's range to next to nothing, and what rounding has left below zero would stay while the rest shrinks.
pub(crate) struct Columns([[f64; 3]; 3]);

/// Any 3×3 matrix, row by row: gains and products of symmetric matrices.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Square3(pub(crate) [[f64; 3]; 3]);

impl Symmetric3 {
    pub(crate) const ZERO: Self = Self {
        xx: 0.0,
        xy: 0.0,
        xp: 0.0,
        yy: 0.0,
        yp: 0.0,
        pp: 0.0,
    };

    /// `w · c cᵀ`
    #[inline]
    pub(crate) fn outer(w: f64, c: [f64; 3]) -> Self {
        let [x, y, p] = c;
        let (wx, wy) = (w * x, w * y);
        Self {
            xx: wx * x,
            xy: wx * y,
            xp: wx * p,
            yy: wy * y,
            yp: wy * p,
            pp: w * p * p,
        }
    }

    /// The three rows.
    #[inline]
    pub(crate) fn rows(&self) -> [[f64; 3]; 3] {
        [
            [self.xx, self.xy, self.xp],
            [self.xy, self.yy, self.yp],
            [self.xp, self.yp, self.pp],
        ]
    }

    /// The matrix times a vector.
    #[inline]
    pub(crate) fn apply(&self, v: [f64; 3]) -> [f64; 3] {
        self.rows().map(|row| dot(row, v))
    }

    /// `vᵀ A v`
    #[inline]
    pub(crate) fn quadratic(&self, v: [f64; 3]) -> f64 {
        dot(v, self.apply(v))
    }

    /// `A⁻¹ det A`
    #[inline]
    pub(crate) fn adjugate(&self) -> Self {
        let Self {
            xx,
            xy,
            xp,
            yy,
            yp,
            pp,
        } = *self;
        Self {
            xx: yy * pp - yp * yp,
            xy: xp * yp - xy * pp,
            xp: xy * yp - xp * yy,
            yy: xx * pp - xp * xp,
            yp: xy * xp - xx * yp,
            pp: xx * yy - xy * xy,
        }
    }

    /// `A B`
    #[inline]
    pub(crate) fn times(&self, b: &Self) -> Square3 {
        Square3(self.rows().map(|row| b.apply(row)))
    }
}

impl Square3 {
    pub(crate) const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);

    /// `G v`
    #[inline]
    pub(crate) fn apply(&self, v: [f64; 3]) -> [f64; 3] {
        self.0.map(|row| dot(row, v))
    }

    /// `w G`
    #[inline]
    pub(crate) fn scaled(&self, w: f64) -> Self {
        Self(self.0.map(|row| row.map(|entry| w * entry)))
    }

    /// `I − G`
    #[inline]
    pub(crate) fn complement(&self) -> Self {
        let [[a, b, c], [d, e, f], [g, h, i]] = self.0;
        Self([[1.0 - a, -b, -c], [-d, 1.0 - e, -f], [-g, -h, 1.0 - i]])
    }

    /// `G L`
    #[inline]
    pub(crate) fn columns(&self, factor: &Factor) -> Columns {
        let ([[x1, x2, x3], [y1, y2, y3], [p1, p2, p3]], [l21, l31, l32]) = (self.0, factor.lower);
        Columns([
            [
                x1 + l21 * x2 + l31 * x3,
                y1 + l21 * y2 + l31 * y3,
                p1 + l21 * p2 + l31 * p3,
            ],
            [x2 + l32 * x3, y2 + l32 * y3, p2 + l32 * p3],
            [x3, y3, p3],
        ])
    }

    /// `G A Gᵀ` of a positive semidefinite A: a sum of squares ([`Columns`]).
    #[inline(never)]
    pub(crate) fn congruence(&self, a: &Symmetric3) -> Symmetric3 {
        let factor = Factor::new(a);
        self.columns(&factor).square(&factor)
    }

    /// `tr G A Gᵀ`
    #[inline]
    pub(crate) fn congruence_trace(&self, a: &Symmetric3) -> f64 {
        let [x, y, p] = self.0;
        a.quadratic(x) + a.quadratic(y) + a.quadratic(p)
    }

    /// `tr G F`
    #[inline]
    pub(crate) fn product_trace(&self, f: &Self) -> f64 {
        let ([a, b, c], [x, y, z]) = (self.0, f.0);
        dot(a, [x[0], y[0], z[0]]) + dot(b, [x[1], y[1], z[1]]) + dot(c, [x[2], y[2], z[2]])
    }
}

impl Columns {
    /// `G A Gᵀ`
    #[inline]
    pub(crate) fn square(&self, factor: &Factor) -> Symmetric3 {
        let ([first, second, third], [d1, d2, d3]) = (self.0, factor.pivots);
        Symmetric3::outer(d1, first) + Symmetric3::outer(d2, second) + Symmetric3::outer(d3, third)
    }

    /// `G L y`
    #[inline]
    pub(crate) fn apply(&self, [a, b, c]: [f64; 3]) -> [f64; 3] {
        let [[x1, y1, p1], [x2, y2, p2], [x3, y3, p3]] = self.0;
        [
            a * x1 + b * x2 + c * x3,
            a * y1 + b * y2 + c * y3,
            a * p1 + b * p2 + c * p3,
        ]
    }
}

impl Add for Symmetric3 {
    type Output = Self;
    #[inline]
    fn add(self, b: Self) -> Self {
        Self {
            xx: self.xx + b.xx,
            xy: self.xy + b.xy,
            xp: self.xp + b.xp,
            yy: self.yy + b.yy,
            yp: self.yp + b.yp,
            pp: self.pp + b.pp,
        }
    }
}

impl Sub for Symmetric3 {
    type Output = Self;
    #[inline]
    fn sub(self, b: Self) -> Self {
        self + b * -1.0
    }
}

impl Mul<f64> for Symmetric3 {
    type Output = Self;
    #[inline]
    fn mul(self, w: f64) -> Self {
        Self {
            xx: self.xx * w,
            xy: self.xy * w,
            xp: self.xp * w,
            yy: self.yy * w,
            yp: self.yp * w,
            pp: self.pp * w,
        }
    }
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Symmetric3 = Symmetric3 {
        xx: 4.0,
        xy: 1.0,
        xp: -2.0,
        yy: 3.0,
        yp: 0.5,
        pp: 5.0,
    };
    const B: Symmetric3 = Symmetric3 {
        xx: 2.0,
        xy: -1.0,
        xp: 0.5,
        yy: 6.0,
        yp: 1.5,
        pp: 1.0,
    };

    #[test]
    fn a_congruence_is_that_of_the_library() {
        let g = A.times(&B);
        let (found, a) = (matrix(&g.congruence(&A).rows()), matrix(&A.rows()));
        let expected = matrix(&g.0) * a * matrix(&g.0).transpose();
        for (a, b) in found.iter().zip(expected.iter()) {
            assert!((a - b).abs() < 1e-12 * a.abs(), "{a} is not {b}");
        }
    }

    #[test]
    fn products_agree_with_the_library() {
        let (a, b) = (matrix(&A.rows()), matrix(&B.rows()));
        let g = A.times(&B);
        assert_eq!(matrix(&g.0), a * b);
        assert_eq!(
            g.congruence_trace(&B).to_bits(),
            (a * b * b * b * a).trace().to_bits()
        );
        assert_eq!(
            g.product_trace(&B.times(&A)).to_bits(),
            (a * b * b * a).trace().to_bits()
        );
        assert_eq!(
            matrix(&g.complement().0),
            nalgebra::Matrix3::identity() - a * b
        );
    }

    /// G takes A's only column to 1e-9 of itself: 1e-18 of A, which no sum of products of its size holds.
    #[test]
    fn what_is_taken_to_next_to_nothing_has_no_variance_below_zero() {
        let mut cancelled = 0;
        for turn in 0..1000 {
            let c = [1.0 / 3.0, 0.1 + 1e-3 * f64::from(turn), -0.7];
            let a = Symmetric3::outer(0.3, c);
            let g = Square3([[c[1], -c[0], 1e-9], [c[2], 0.0, -c[0]], [0.0, c[2], -c[1]]]);
            let product = g.congruence(&a);
            assert!(
                product.xx >= 0.0 && product.yy >= 0.0 && product.pp >= 0.0,
                "{product:?}"
            );
            let [x, ..] = g.0;
            cancelled += i32::from(dot(a.apply(x), x) < 0.0);
        }
        assert!(cancelled > 10, "{cancelled} cases put it to the test");
    }

    fn matrix(rows: &[[f64; 3]; 3]) -> nalgebra::Matrix3<f64> {
        nalgebra::Matrix3::from_row_slice(rows.as_flattened())
    }
}
