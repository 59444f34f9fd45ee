//! A hypothesis as a belief: a direction has length one, and so tells of the heading and of the position what no linear filter knows.
//!
//! The filter knows `(p, u)` as Gaussian. Of that distribution only what lies on the circle `u = (cos φ, sin φ)` can be; the prior
//! `u ~ (0, ½ I)` is the same all around it. With `Λ` the inverse of `C_uu`, widened along the direction by the error of the
//! wheels' scale,
//!
//! ```text
//! w(φ) ∝ exp(−½ (u(φ) − û)ᵀ Λ (u(φ) − û))        E[p | φ] = p̂ + G (u(φ) − û), G = C_pu Λ
//! S = C_pp − G C_puᵀ                             Cov(p | φ), at any φ
//! ```
//!
//! The heading's mean φ̄ and variance s are sums over the circle, and s no less than the variance of û across it: of a heading that was
//! Gaussian before, the length of û is a consequence, and nothing that was learnt. With it as a Gaussian the moments of the pose are exact, and so is its
//! bend: `g_a` and `g_b` are the columns of `G` along and across φ̄, e, Ω and `C_b` those of s ([`crate::honest`]),
//!
//! ```text
//! p̄ = p̂ + G ((e, 0) − û)     P_pφ = e s g_b     k_a = Ω_a g_a     k_b = Ω_b g_b
//! P_pp = S + (Ω_a + x) g_a g_aᵀ + C_b g_b g_bᵀ
//! ```
//!
//! x is zero but where S is so small that the bend would be far outside ([`BENT`]).

use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2};

use super::columns::Columns;
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::honest::{Bend, Circle};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::symmetric::Symmetric3;

/// It is summed over so many headings to each side of one, and so far, in σ.
const TO_EACH_SIDE: i32 = 16;
const REACH: f64 = 8.0;

/// Of the variance along the way, what the bend may add to it. A belief is updated as a Gaussian, and a heading that is off by three σ
/// and more is on a bend: where the position was known well before the way began, that is far outside. So along the way it is known
/// only so well.
const BENT: f64 = 0.1;

/// `(p, u)` as the filter knows it.
#[derive(Copy, Clone, Debug)]
pub(super) struct Joint {
    pub(super) position: Vector2<f64>,
    pub(super) direction: Vector2<f64>,
    /// `C_pp`
    pub(super) pp: Matrix2<f64>,
    /// `C_pu`
    pub(super) pu: Matrix2<f64>,
    /// `C_uu`, widened along the direction.
    pub(super) uu: Matrix2<f64>,
}

impl Joint {
    /// The belief that it is if its direction has length one; `heading` and `sigma` are about where it is. `None` if it is certain of
    /// something.
    pub(super) fn on_circle(&self, heading: f64, sigma: f64) -> Option<Belief> {
        let inverse = self.uu.try_inverse()?;
        let (mean, on_circle) = self.heading(&inverse, heading, sigma)?;
        let variance = on_circle.max(self.across());
        let (gain, own) = self.conditional()?;
        let circle = Circle::of(variance, 0.0);
        let ahead = unit(mean);
        let (along, across) = (gain * ahead, gain * Vector2::new(-ahead.y, ahead.x));
        let position = self.position + gain * (circle.mean * ahead - self.direction);
        let spread = own
            + (circle.along + doubt(&own, &along, circle.along)) * along * along.transpose()
            + circle.sine * across * across.transpose();
        let turned = circle.mean * variance * across;
        let covariance = Symmetric3 {
            xx: spread.m11,
            xy: spread.m21,
            yy: spread.m22,
            xp: turned.x,
            yp: turned.y,
            pp: variance,
        };
        let column = |of: Vector2<f64>| [of.x, of.y, 0.0];
        Some(Belief {
            pose: Pose::new(position.x, position.y, mean),
            parts: Parts::dependent(Covariance3::trusted(&covariance)),
            bend: Bend {
                along: column(circle.along * along),
                across: column(circle.across * across),
            },
        })
    }

    /// G and S: what is left of C once u is known.
    fn conditional(&self) -> Option<(Matrix2<f64>, Matrix2<f64>)> {
        let mut all = Matrix4::zeros();
        let mut set = |row: usize, column: usize, block: &Matrix2<f64>| {
            all.fixed_view_mut::<2, 2>(row, column).copy_from(block);
        };
        set(0, 0, &self.pp);
        set(0, 2, &self.pu);
        set(2, 0, &self.pu.transpose());
        set(2, 2, &self.uu);
        let direction = Matrix2x4::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let known = Columns::of(&all).learn(&direction, &Matrix2::zeros())?;
        let block = |it: &Matrix4<f64>| it.fixed_view::<2, 2>(0, 0).into_owned();
        Some((
            known.gain.fixed_rows::<2>(0).into_owned(),
            block(&known.covariance),
        ))
    }

    /// The variance of û across it.
    fn across(&self) -> f64 {
        let ahead = self.direction / self.direction.norm();
        let aside = Vector2::new(-ahead.y, ahead.x);
        aside.dot(&(self.uu * aside))
    }

    /// Mean and variance over the circle; the sums of a periodic function are exact to many digits.
    fn heading(&self, inverse: &Matrix2<f64>, about: f64, sigma: f64) -> Option<(f64, f64)> {
        let half = (REACH * sigma).min(core::f64::consts::PI);
        let step = 2.0 * half / f64::from(2 * TO_EACH_SIDE + 1);
        let turns = || (-TO_EACH_SIDE..=TO_EACH_SIDE).map(move |k| step * f64::from(k));
        let cost = |turn: f64| {
            let apart = unit(about + turn) - self.direction;
            0.5 * apart.dot(&(inverse * apart))
        };
        let least = turns().map(cost).fold(f64::INFINITY, f64::min);
        let (mut sum, mut first, mut second) = (0.0, 0.0, 0.0);
        for turn in turns() {
            let weight = libm::exp(least - cost(turn));
            sum += weight;
            first += weight * turn;
            second += weight * turn * turn;
        }
        let mean = first / sum;
        let variance = second / sum - mean * mean;
        (variance > 0.0 && variance.is_finite()).then_some((about + mean, variance))
    }
}

/// x: with it the bend adds no more than that to the variance along the way; nothing where there was no way.
fn doubt(own: &Matrix2<f64>, along: &Vector2<f64>, bent: f64) -> f64 {
    let known = own
        .try_inverse()
        .map_or(f64::INFINITY, |inverse| along.dot(&(inverse * along)));
    if known > 0.0 {
        (bent / BENT - 1.0 / known).max(0.0)
    } else {
        0.0
    }
}

fn unit(heading: f64) -> Vector2<f64> {
    let (sin, cos) = libm::sincos(heading);
    Vector2::new(cos, sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A way of `way` metres ahead from a place known to `sigma`, and a direction as it was measured, with noise of `noise`.
    fn driven(way: f64, sigma: f64, direction: [f64; 2], noise: f64) -> Joint {
        let (uu, direction) = (Matrix2::identity() * noise, Vector2::from(direction));
        Joint {
            position: way * direction,
            direction,
            pp: Matrix2::identity() * (sigma * sigma) + way * way * uu,
            pu: way * uu,
            uu,
        }
    }

    fn found(joint: &Joint) -> Belief {
        let [x, y] = joint.direction.into();
        joint.on_circle(libm::atan2(y, x), 0.3).unwrap()
    }

    /// What was measured is too long: the filter has it too far ahead, and a direction is not.
    #[test]
    fn a_direction_has_length_one() {
        let belief = found(&driven(2.0, 0.05, [1.3, 0.0], 0.01));
        let e = Circle::of(belief.heading_variance(), 0.0).mean;
        assert!((belief.pose.x - 2.0 * e).abs() < 1e-9 && belief.pose.y.abs() < 1e-9);
        let [x, y, heading] = belief.total().variances();
        assert!(x < 0.003 && (0.02..0.05).contains(&y), "{x} {y}");
        assert!((heading - 0.01).abs() < 1e-9, "{heading}");
    }

    /// The position of each heading on the circle is on the arc: the moments of many that are drawn are those of the belief.
    #[test]
    fn its_moments_are_those_of_the_arc() {
        let belief = found(&driven(2.0, 0.3, [0.6, 0.8], 0.04));
        let (heading, total) = (belief.heading_variance(), belief.total().symmetric());
        let (mut x, mut xx, mut xp, mut sum) = (0.0, 0.0, 0.0, 0.0);
        for k in -400..=400 {
            let turn = 0.02 * f64::from(k) * libm::sqrt(heading);
            let weight = libm::exp(-0.5 * turn * turn / heading);
            let ahead =
                2.0 * unit(belief.pose.phi + turn) - Vector2::new(belief.pose.x, belief.pose.y);
            sum += weight;
            x += weight * ahead.x;
            xx += weight * ahead.x * ahead.x;
            xp += weight * ahead.x * turn;
        }
        assert!((x / sum).abs() < 1e-6, "{x}");
        assert!((xx / sum + 0.09 - total.xx).abs() < 1e-6);
        assert!((xp / sum - total.xp).abs() < 1e-6);
        let bend = Belief::new(belief.pose, belief.parts, belief.bend);
        assert_eq!(bend.as_ref(), Ok(&belief), "it holds its bend");
    }

    /// Whose heading is off by three σ is on the arc, 0.18 m beside the tangent.
    #[test]
    fn who_knew_well_where_he_began_is_not_far_outside_on_the_bend() {
        let outside = |sigma: f64| {
            let belief = found(&driven(2.0, sigma, [1.0, 0.0], 0.01));
            let apart = 2.0 * unit(0.3) - Vector2::new(belief.pose.x, belief.pose.y);
            let factor = crate::factor::Factor::new(&belief.total().symmetric());
            factor.distance([apart.x, apart.y, 0.3 - belief.pose.phi])
        };
        assert!(outside(0.5) < 9.5 && outside(0.01) < 20.0);
    }

    /// Its length is as it has to be, which is nothing new.
    #[test]
    fn a_heading_that_was_known_is_not_known_better() {
        let circle = Circle::of(0.05, 0.0);
        let joint = Joint {
            uu: Matrix2::new(circle.along, 0.0, 0.0, circle.sine),
            ..driven(0.0, 0.1, [circle.mean, 0.0], 1.0)
        };
        let joint = Joint {
            pu: Matrix2::zeros(),
            ..joint
        };
        let variance = found(&joint).heading_variance();
        assert!((0.045..0.05).contains(&variance), "{variance}");
    }
}
