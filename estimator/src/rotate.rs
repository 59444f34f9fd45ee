//! A covariance of what is in a body's frame, seen from another heading.

use crate::factor::Factor;
use crate::symmetric::Symmetric3;

/// `Γ N Γᵀ`, so that a singular N stays one to rounding.
#[inline]
pub(crate) fn rotated(noise: &Symmetric3, sin: f64, cos: f64) -> Symmetric3 {
    if noise.xy != 0.0 {
        return rotated_by_columns(noise, sin, cos);
    }
    Symmetric3 {
        xx: cos * cos * noise.xx + sin * sin * noise.yy,
        xy: cos * sin * (noise.xx - noise.yy),
        xp: cos * noise.xp - sin * noise.yp,
        yy: sin * sin * noise.xx + cos * cos * noise.yy,
        yp: sin * noise.xp + cos * noise.yp,
        pp: noise.pp,
    }
}

/// Column by column of `N = L D Lᵀ`: with x and y correlated, the direct sum would cancel where N is singular.
fn rotated_by_columns(noise: &Symmetric3, sin: f64, cos: f64) -> Symmetric3 {
    let factor = Factor::new(noise);
    let [l21, l31, l32] = factor.lower;
    let [d1, d2, d3] = factor.pivots;
    Symmetric3::outer(d1, [cos - sin * l21, sin + cos * l21, l31])
        + Symmetric3::outer(d2, [-sin, cos, l32])
        + Symmetric3::outer(d3, [0.0, 0.0, 1.0])
}
