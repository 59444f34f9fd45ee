//! Turns in the plane.

use nalgebra::{Matrix2, Vector2};

/// `J = C(π/2)`
pub(crate) const J: Matrix2<f64> = Matrix2::new(0.0, -1.0, 1.0, 0.0);

/// `C(a)`
pub(crate) fn turn(a: f64) -> Matrix2<f64> {
    let (sin, cos) = libm::sincos(a);
    Matrix2::new(cos, -sin, sin, cos)
}

/// `U(a) = C(a)ᵀ`: its rows are along the line of sight and across it.
pub(crate) fn sight(a: f64) -> Matrix2<f64> {
    turn(a).transpose()
}

/// `(cos a, sin a)`
pub(crate) fn unit(a: f64) -> Vector2<f64> {
    let (sin, cos) = libm::sincos(a);
    Vector2::new(cos, sin)
}

/// The direction of `v` \[rad\].
pub(crate) fn azimuth(v: Vector2<f64>) -> f64 {
    libm::atan2(v.y, v.x)
}

/// How the azimuth of `v` moves with `v`: `(−y, x)/r²`.
pub(crate) fn azimuth_slope(v: Vector2<f64>) -> Vector2<f64> {
    J * v / v.norm_squared()
}
