//! Vectors of the plane as complex numbers, and their second moments: what is turned is multiplied, and so are its moments.

use nalgebra::{Complex, Matrix2};

pub(crate) type Point = Complex<f64>;

/// The second moments of two random points x and y: `E x ȳ` and `E x y`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Crossed {
    pub(crate) with_conjugate: Point,
    pub(crate) plain: Point,
}

/// Those of a random point x with itself: `E |x|²` and `E x²`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Squared {
    pub(crate) length: f64,
    pub(crate) plain: Point,
}

impl Crossed {
    pub(crate) const ZERO: Self = Self {
        with_conjugate: Point::new(0.0, 0.0),
        plain: Point::new(0.0, 0.0),
    };

    /// Of `E x yᵀ`.
    pub(crate) fn of(m: &Matrix2<f64>) -> Self {
        Self {
            with_conjugate: Point::new(m.m11 + m.m22, m.m21 - m.m12),
            plain: Point::new(m.m11 - m.m22, m.m21 + m.m12),
        }
    }

    /// `E x yᵀ`
    pub(crate) fn matrix(&self) -> Matrix2<f64> {
        let (a, b) = (self.with_conjugate, self.plain);
        0.5 * Matrix2::new(a.re + b.re, b.im - a.im, a.im + b.im, a.re - b.re)
    }
}

impl Squared {
    pub(crate) const ZERO: Self = Self {
        length: 0.0,
        plain: Point::new(0.0, 0.0),
    };

    /// Of `variance · I`.
    pub(crate) fn round(variance: f64) -> Self {
        Self {
            length: 2.0 * variance,
            ..Self::ZERO
        }
    }

    /// Of `E x xᵀ`.
    pub(crate) fn of(m: &Matrix2<f64>) -> Self {
        Self {
            length: m.m11 + m.m22,
            plain: Point::new(m.m11 - m.m22, 2.0 * m.m21),
        }
    }

    /// `E x xᵀ`
    pub(crate) fn matrix(&self) -> Matrix2<f64> {
        let (length, plain) = (self.length, self.plain);
        let across = 0.5 * plain.im;
        Matrix2::new(
            0.5 * (length + plain.re),
            across,
            across,
            0.5 * (length - plain.re),
        )
    }

    /// The variances along a direction of length one, and across it.
    pub(crate) fn along_and_across(&self, along: Point) -> [f64; 2] {
        let differ = (self.plain * (along * along).conj()).re;
        [0.5 * (self.length + differ), 0.5 * (self.length - differ)].map(|it| it.max(0.0))
    }
}

/// A quarter of a turn to the left.
pub(crate) fn left(point: Point) -> Point {
    Point::new(-point.im, point.re)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_and_moments_say_the_same() {
        let any = Matrix2::new(1.0, 2.0, -3.0, 5.0);
        assert_eq!(Crossed::of(&any).matrix(), any);
        let symmetric = Matrix2::new(4.0, 1.0, 1.0, 2.0);
        assert_eq!(Squared::of(&symmetric).matrix(), symmetric);
    }

    #[test]
    fn a_variance_along_is_that_of_the_matrix() {
        let squares = Matrix2::new(4.0, 1.0, 1.0, 2.0);
        let v = nalgebra::Vector2::new(0.6, 0.8);
        let [along, across] = Squared::of(&squares).along_and_across(Point::new(v.x, v.y));
        assert!((along - v.dot(&(squares * v))).abs() < 1e-15);
        assert!((along + across - 6.0).abs() < 1e-15);
    }
}
