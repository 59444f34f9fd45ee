//! From what was measured in the body frame to a displacement: along the arc on which both are constant.
//!
//! With `d` the translation that is held in the body frame while it turns by Δ, `h = Δ/2` and `D_0` the covariance of `(d, Δ)`:
//!
//! ```text
//! t = g R(h) d      ∂t/∂d = g R(h)      ∂t/∂Δ = ½ (g' R(h) d + g J R(h) d)      D = J₃ D_0 J₃ᵀ, J₃ with [0 0 1] below
//! g = sin h / h     g' = (h cos h − sin h)/h²
//! ```
//!
//! All of it seen from the heading φ costs one sine and cosine, those of φ + h.

use core::f64::consts::PI;

use super::plane::Plane;
use crate::angle::wrap;
use crate::covariance::{Covariance2, Covariance3};
use crate::factor::Factor;
use crate::rotate::rotated;
use crate::symmetric::{Square3, Symmetric3};

/// Half a turn below which g and g' are series \[rad\].
const SERIES: f64 = 0.1;

/// Of g: `1 − h²/6 (1 − h²/20 (1 − h²/42 (1 − h²/72)))`.
const G: [f64; 4] = [-1.0 / 6.0, 1.0 / 120.0, -1.0 / 5_040.0, 1.0 / 362_880.0];

/// Of g': `−h/3 (1 − h²/10 (1 − h²/28 (1 − h²/54 (1 − h²/88))))`.
const SLOPE: [f64; 5] = [
    -1.0 / 3.0,
    1.0 / 30.0,
    -1.0 / 840.0,
    1.0 / 45_360.0,
    -1.0 / 3_991_680.0,
];

/// A displacement in the body frame at its start, a turn, and the covariance of their noise.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Increments {
    /// t \[m\]
    pub translation: [f64; 2],
    /// Δ \[rad\]
    pub turn: f64,
    /// D \[m², m·rad, rad²\]
    pub noise: Covariance3,
}

/// The same seen from a heading.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Swept {
    /// `r` \[m\]
    pub(crate) way: Plane,
    /// Δ \[rad\]
    pub(crate) turn: f64,
    /// `[[N, ρ], [ρᵀ, q]]`
    pub(crate) noise: Symmetric3,
}

impl Increments {
    /// Of a translation `[d_x, d_y]` \[m\] held in the body frame while it turns by Δ \[rad\], `held = [d_x, d_y, Δ]`; `noise` is
    /// `D_0`.
    #[must_use]
    pub fn arc(held: [f64; 3], noise: &Covariance3) -> Self {
        let Swept { way, turn, noise } = Swept::arc(0.0, held, &noise.symmetric());
        Self {
            translation: [way.x, way.y],
            turn,
            noise: Covariance3::trusted(&noise),
        }
    }

    /// [`Self::arc`] the other way round: what has to be held to come where this leads, and `D_0`. A turn counts modulo 2π, so
    /// that there is such an arc.
    pub(crate) fn held(&self) -> ([f64; 3], Covariance3) {
        let turn = if self.turn.abs() > PI {
            wrap(self.turn)
        } else {
            self.turn
        };
        let half = 0.5 * turn;
        let ((g, slope), (sin, cos)) = (chord(half), libm::sincos(half));
        let back = [cos / g, sin / g];
        let [x, y] = turned_back(back, self.translation);
        let by_turn = [0.5 * (slope * x - g * y), 0.5 * (slope * y + g * x)]; // R(−h) ∂t/∂Δ
        let [bx, by] = by_turn.map(|it| -it / g);
        let inverse = Square3([
            [back[0], back[1], bx],
            [-back[1], back[0], by],
            [0.0, 0.0, 1.0],
        ]);
        let noise = inverse.congruence(&self.noise.symmetric());
        ([x, y, turn], Covariance3::trusted(&noise))
    }

    /// Of the ways `[left, right]` \[m\] of two wheels `base` \[m\] apart, the covariance of these, and the variance of a slip to
    /// the side \[m²\].
    #[must_use]
    pub fn wheels([left, right]: [f64; 2], base: f64, noise: &Covariance2, slip: f64) -> Self {
        let w = noise.matrix();
        let (differs, ways) = (w.m22 - w.m11, (w.m11 + w.m22) + 2.0 * w.m21);
        let turns = (w.m11 + w.m22) - 2.0 * w.m21;
        let noise = Symmetric3 {
            xx: 0.25 * ways,
            xp: 0.5 * differs / base,
            yy: slip,
            pp: turns / (base * base),
            ..Symmetric3::ZERO
        };
        let held = [0.5 * (left + right), 0.0, (right - left) / base];
        Self::arc(held, &Covariance3::trusted(&noise))
    }

    /// Seen from the heading `phi` \[rad\].
    #[inline]
    pub(crate) fn swept(&self, phi: f64) -> Swept {
        let (sin, cos) = libm::sincos(phi);
        let [x, y] = self.translation;
        Swept {
            way: Plane::new(cos * x - sin * y, sin * x + cos * y),
            turn: self.turn,
            noise: rotated(&self.noise.symmetric(), sin, cos),
        }
    }
}

impl Swept {
    /// Of `held = [d_x, d_y, Δ]` with noise `D_0`, from the heading `phi` \[rad\].
    #[inline]
    pub(crate) fn arc(phi: f64, held: [f64; 3], noise: &Symmetric3) -> Self {
        let (sin, cos) = libm::sincos(phi + 0.5 * held[2]);
        Self::arc_along([sin, cos], held, noise)
    }

    /// The same, of sine and cosine of the heading in the middle of the arc.
    #[inline]
    pub(crate) fn arc_along(middle: [f64; 2], held: [f64; 3], noise: &Symmetric3) -> Self {
        Self::along(middle, held, noise).0
    }

    /// [`Self::arc`], and where `column`, an error of `held`, is seen from the heading.
    #[inline]
    pub(crate) fn arc_with(
        phi: f64,
        held: [f64; 3],
        noise: &Symmetric3,
        column: [f64; 3],
    ) -> (Self, [f64; 3]) {
        let (sin, cos) = libm::sincos(phi + 0.5 * held[2]);
        let (swept, jacobian) = Self::along([sin, cos], held, noise);
        (swept, jacobian.apply(column))
    }

    #[inline]
    fn along([sin, cos]: [f64; 2], held: [f64; 3], noise: &Symmetric3) -> (Self, Jacobian) {
        let [x, y, turn] = held;
        let (g, slope) = chord(0.5 * turn);
        let held = Plane::new(cos * x - sin * y, sin * x + cos * y);
        let way = g * held;
        let jacobian = Jacobian {
            ahead: g * Plane::new(cos, sin),
            by_turn: 0.5 * (slope * held + way.left()),
        };
        let swept = Self {
            way,
            turn,
            noise: jacobian.carry(noise),
        };
        (swept, jacobian)
    }
}

/// The way of an arc, `held` in the body frame \[m, m, rad\], seen from the heading `phi` \[rad\].
#[inline]
pub(crate) fn chord_of(phi: f64, held: [f64; 3]) -> Plane {
    let [x, y, turn] = held;
    let half = 0.5 * turn;
    let (sin, cos) = libm::sincos(phi + half);
    let (g, _) = chord(half);
    g * Plane::new(cos * x - sin * y, sin * x + cos * y)
}

#[inline]
fn turned_back([cos, sin]: [f64; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    [cos * x + sin * y, cos * y - sin * x]
}

/// g and g' of half a turn.
#[inline]
fn chord(half: f64) -> (f64, f64) {
    if half.abs() >= SERIES {
        return wide_chord(half);
    }
    let z = half * half;
    let g = 1.0 + z * (G[0] + z * (G[1] + z * (G[2] + z * G[3])));
    let slope = SLOPE[0] + z * (SLOPE[1] + z * (SLOPE[2] + z * (SLOPE[3] + z * SLOPE[4])));
    (g, half * slope)
}

#[cold]
fn wide_chord(half: f64) -> (f64, f64) {
    let (sin, cos) = libm::sincos(half);
    let g = sin / half;
    (g, (cos - g) / half)
}

/// `J₃` in the common frame: its first column, which turned by a right angle is the second, and its third.
struct Jacobian {
    ahead: Plane,
    by_turn: Plane,
}

impl Jacobian {
    /// `J₃ D_0 J₃ᵀ`, sums of squares alone, so that a singular `D_0` stays one to rounding.
    #[inline]
    fn carry(&self, noise: &Symmetric3) -> Symmetric3 {
        if noise.xy != 0.0 || noise.xp != 0.0 || noise.yp != 0.0 {
            return self.carry_columns(noise);
        }
        let (ahead, by_turn) = (self.ahead, self.by_turn);
        let squares = ahead.times(ahead);
        let with_turn = noise.pp * by_turn;
        let variances =
            noise.xx * squares + noise.yy * squares.swapped() + with_turn.times(by_turn);
        Symmetric3 {
            xx: variances.x,
            yy: variances.y,
            xp: with_turn.x,
            yp: with_turn.y,
            xy: ahead.x * ahead.y * (noise.xx - noise.yy) + with_turn.x * by_turn.y,
            pp: noise.pp,
        }
    }

    /// Column by column of `D_0 = L D Lᵀ`.
    fn carry_columns(&self, noise: &Symmetric3) -> Symmetric3 {
        let factor = Factor::new(noise);
        let [l21, l31, l32] = factor.lower;
        let [d1, d2, d3] = factor.pivots;
        Symmetric3::outer(d1, self.apply([1.0, l21, l31]))
            + Symmetric3::outer(d2, self.apply([0.0, 1.0, l32]))
            + Symmetric3::outer(d3, self.apply([0.0, 0.0, 1.0]))
    }

    #[inline]
    fn apply(&self, [x, y, turn]: [f64; 3]) -> [f64; 3] {
        let moved = x * self.ahead + y * self.ahead.left() + turn * self.by_turn;
        [moved.x, moved.y, turn]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_and_sines_say_the_same_where_they_meet() {
        for half in [SERIES, -SERIES] {
            let (series, sines) = (chord(half * (1.0 - 1e-15)), wide_chord(half));
            assert!((series.0 - sines.0).abs() < 1e-15);
            assert!((series.1 - sines.1).abs() < 1e-13);
        }
        assert_eq!(chord(0.0), (1.0, 0.0));
    }

    /// A circle of 2 m, once round and half round.
    #[test]
    fn who_drives_a_circle_comes_back() {
        let turn = core::f64::consts::TAU;
        let held = [2.0 * turn, 0.0, turn];
        let round = Increments::arc(held, &Covariance3::ZERO);
        assert!(round.translation.iter().all(|it| it.abs() < 1e-14));
        let half = Increments::arc(held.map(|it| 0.5 * it), &Covariance3::ZERO);
        let [x, y] = half.translation;
        assert!(x.abs() < 1e-14 && (y - 4.0).abs() < 1e-14, "{x} {y}");
    }

    #[test]
    fn what_has_to_be_held_leads_there() {
        let noise = Covariance3::from_row_major([
            0.04, 0.01, 0.002, 0.01, 0.02, -0.003, 0.002, -0.003, 0.01,
        ])
        .unwrap();
        for turn in [0.0, 0.1, -1.0, 3.1, -3.1, 6.0, 7.0] {
            let one = Increments {
                translation: [1.0, -0.3],
                turn,
                noise,
            };
            let (held, spread) = one.held();
            let other = Increments::arc(held, &spread);
            assert!(wrap(other.turn - turn).abs() < 1e-14);
            let [x, y] = other.translation;
            assert!((x - 1.0).abs() < 1e-14 && (y + 0.3).abs() < 1e-14, "{turn}");
            let error = (other.noise.matrix() - noise.matrix()).abs().max();
            assert!(error < 1e-15, "{turn}: {error:e}");
        }
    }

    #[test]
    fn correlated_noise_is_carried_as_uncorrelated_is() {
        let noise = Symmetric3 {
            xx: 0.04,
            yy: 0.01,
            pp: 0.09,
            ..Symmetric3::ZERO
        };
        let jacobian = Jacobian {
            ahead: Plane::new(0.6, 0.7),
            by_turn: Plane::new(-0.3, 0.2),
        };
        let (plain, columns) = (jacobian.carry(&noise), jacobian.carry_columns(&noise));
        let pairs = plain.rows().into_iter().zip(columns.rows());
        for (a, b) in pairs.flat_map(|(a, b)| a.into_iter().zip(b)) {
            assert!((a - b).abs() < 1e-16, "{a} is not {b}");
        }
    }
}
