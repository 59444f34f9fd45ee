//! One step of what passes without a measurement.

use super::circle::{Circle, kept};
use super::{Bend, Increments, Swept};
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::factor::Factor;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::symmetric::Symmetric3;

/// A variance of which less than this is left has cancelled: too few digits of it are right.
const CANCELLED: f64 = 1e-4;

/// `A = [[I, a], [0, 1]]`: what a step makes of an error of the pose before it.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// `a = e J r`: how the position after it moves with the heading before it \[m/rad\].
    pub by_heading: [f64; 2],
}

/// A belief after a step, and the map that took it there.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Moved {
    /// The belief.
    pub belief: Belief,
    /// A, for whoever carries a correlation with others along.
    pub map: Map,
}

/// `belief` after what was measured of a motion in its body frame.
#[must_use]
pub fn advance(belief: &Belief, increments: &Increments) -> Moved {
    step(belief, &increments.swept(belief.pose.phi))
}

/// `belief` after the displacement.
#[inline]
pub(crate) fn step(belief: &Belief, swept: &Swept) -> Moved {
    let (independent, dependent) = (
        belief.parts.independent.symmetric(),
        belief.parts.dependent.symmetric(),
    );
    let circle = Circle::of(independent.pp + dependent.pp);
    let [x, y] = swept.way;
    let map = Map {
        by_heading: [-circle.mean * y, circle.mean * x],
    };
    let bend = belief.bend.mapped(&map);
    let added = shortened(&swept.noise, circle.mean);
    let bent = curvature(&circle, swept, &bend);
    let Pose { x: px, y: py, phi } = belief.pose;
    let belief = Belief {
        pose: Pose::new(px + circle.mean * x, py + circle.mean * y, phi + swept.turn),
        parts: Parts {
            independent: Covariance3::trusted(&(map.congruence(&independent) + added)),
            dependent: Covariance3::trusted(&(map.congruence(&dependent) + bent)),
        },
        bend: bent_further(&circle, swept, &bend),
    };
    Moved { belief, map }
}

/// `G D Gᵀ`
#[inline]
fn shortened(noise: &Symmetric3, e: f64) -> Symmetric3 {
    let square = e * e;
    Symmetric3 {
        xx: square * noise.xx,
        xy: square * noise.xy,
        xp: e * noise.xp,
        yy: square * noise.yy,
        yp: e * noise.yp,
        pp: noise.pp,
    }
}

/// `ΔH`, and between position and heading `κ_a r + κ_b J r`; `bend` is `(h, κ)`.
#[inline]
fn curvature(circle: &Circle, swept: &Swept, bend: &Bend) -> Symmetric3 {
    let ([x, y], noise) = (swept.way, &swept.noise);
    let ([ax, ay, ap], [bx, by, bp]) = (bend.along, bend.across);
    let (along, across, sine) = (circle.along, circle.across, circle.sine); // ½ F² and ½ F (2 − F) are Ω_a and C_b.
    Symmetric3 {
        xx: 2.0 * (x * ax - y * bx)
            + (along * (x * x + noise.xx) + across * (y * y) + sine * noise.yy),
        xy: (x * ay + y * ax) + (x * bx - y * by) + (along - across) * (x * y)
            - (sine - along) * noise.xy,
        xp: ap * x - bp * y,
        yy: 2.0 * (y * ay + x * by)
            + (along * (y * y + noise.yy) + across * (x * x) + sine * noise.xx),
        yp: ap * y + bp * x,
        pp: 0.0,
    }
}

/// `k⁺`; `bend` is `(h, κ)`.
#[inline]
fn bent_further(circle: &Circle, swept: &Swept, bend: &Bend) -> Bend {
    let ([x, y], Symmetric3 { xp, yp, pp, .. }) = (swept.way, swept.noise);
    let ([ax, ay, ap], [bx, by, bp]) = (bend.along, bend.across);
    let (along, across, sine) = (circle.along, circle.across, circle.sine);
    let kept = kept(pp);
    Bend {
        along: [
            kept * (ax + along * x + sine * yp),
            kept * (ay + along * y - sine * xp),
            kept * ap,
        ],
        across: [
            kept * (bx - across * y + along * xp),
            kept * (by + across * x + along * yp),
            kept * bp,
        ],
    }
}

impl Map {
    /// `A v`
    #[inline]
    pub(crate) fn apply(&self, [x, y, p]: [f64; 3]) -> [f64; 3] {
        let [ax, ay] = self.by_heading;
        [x + ax * p, y + ay * p, p]
    }

    /// `A P Aᵀ`
    #[inline]
    pub(crate) fn congruence(&self, p: &Symmetric3) -> Symmetric3 {
        let [ax, ay] = self.by_heading;
        let (xp, yp) = (p.xp + ax * p.pp, p.yp + ay * p.pp);
        let product = Symmetric3 {
            xx: p.xx + ax * (p.xp + xp),
            xy: p.xy + ax * p.yp + ay * xp,
            xp,
            yy: p.yy + ay * (p.yp + yp),
            yp,
            pp: p.pp,
        };
        if product.xx < CANCELLED * p.xx || product.yy < CANCELLED * p.yy {
            return self.congruence_by_columns(p);
        }
        product
    }

    /// The columns' own squares cannot cancel.
    #[cold]
    fn congruence_by_columns(&self, p: &Symmetric3) -> Symmetric3 {
        let Factor {
            lower: [l21, l31, l32],
            pivots: [d1, d2, d3],
            ..
        } = Factor::new(p);
        Symmetric3::outer(d1, self.apply([1.0, l21, l31]))
            + Symmetric3::outer(d2, self.apply([0.0, 1.0, l32]))
            + Symmetric3::outer(d3, self.apply([0.0, 0.0, 1.0]))
    }
}
