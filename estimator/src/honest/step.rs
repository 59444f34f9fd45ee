//! One step of what passes without a measurement.

use super::circle::Circle;
use super::plane::Plane;
use super::{Bend, Increments, Swept};
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::factor::Factor;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::symmetric::{Square3, Symmetric3};

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

/// Where `sighting` from `belief` puts what it sees, all noise of the sighting independent.
#[must_use]
pub(crate) fn seen_from(belief: &Belief, sighting: &Increments) -> (Pose, Parts) {
    let swept = sighting.swept(belief.pose.phi);
    let circle = Circle::of(belief.heading_variance(), 0.0); // Nobody is told of the bend, which the noise of the turn shrinks.
    let without = Swept {
        noise: Symmetric3::ZERO,
        ..swept
    };
    let seen = move_by(belief, &without, &circle).belief;
    let independent = seen.parts.independent.symmetric() + turned(&swept.noise, &circle);
    let parts = Parts {
        independent: Covariance3::trusted(&independent),
        ..seen.parts
    };
    (seen.pose, parts)
}

/// The mean of noise in a body frame over the headings that the frame may have. `C_b` is the mean of their squared sine.
#[inline]
fn turned(noise: &Symmetric3, circle: &Circle) -> Symmetric3 {
    let (e, crossed) = (circle.mean, circle.sine);
    let kept = 1.0 - crossed;
    Symmetric3 {
        xx: kept * noise.xx + crossed * noise.yy,
        yy: kept * noise.yy + crossed * noise.xx,
        xp: e * noise.xp,
        yp: e * noise.yp,
        xy: (kept - crossed) * noise.xy,
        pp: noise.pp,
    }
}

/// `belief` after the displacement.
#[inline]
pub(crate) fn step(belief: &Belief, swept: &Swept) -> Moved {
    let circle = Circle::of(belief.heading_variance(), swept.noise.pp);
    move_by(belief, swept, &circle)
}

/// [`step`], and `G` times `column`, an error of the displacement.
#[inline]
pub(crate) fn step_with_column(
    belief: &Belief,
    swept: &Swept,
    [x, y, turn]: [f64; 3],
) -> (Moved, [f64; 3]) {
    let circle = Circle::of(belief.heading_variance(), swept.noise.pp);
    let shortened = [circle.mean * x, circle.mean * y, turn];
    (move_by(belief, swept, &circle), shortened)
}

#[inline]
fn move_by(belief: &Belief, swept: &Swept, circle: &Circle) -> Moved {
    let independent = belief.parts.independent.symmetric();
    let dependent = belief.parts.dependent.symmetric();
    let mean_way = circle.mean * swept.way;
    let map = Map::new(mean_way.left());
    let bend = belief.bend.mapped(|k| map.apply(k));
    let added = shortened(&swept.noise, circle.mean);
    let bent = curvature(circle, swept, &bend);
    let Pose { x, y, phi } = belief.pose;
    let belief = Belief {
        pose: Pose::new(x + mean_way.x, y + mean_way.y, phi + swept.turn),
        parts: Parts {
            independent: Covariance3::trusted(&(map.congruence(&independent) + added)),
            dependent: Covariance3::trusted(&(map.congruence(&dependent) + bent)),
        },
        bend: bent_further(circle, swept, &bend),
    };
    Moved { belief, map }
}

/// `G D Gᵀ`
#[inline]
fn shortened(noise: &Symmetric3, e: f64) -> Symmetric3 {
    let square = e * e;
    Symmetric3 {
        xx: square * noise.xx,
        yy: square * noise.yy,
        xp: e * noise.xp,
        yp: e * noise.yp,
        xy: square * noise.xy,
        pp: noise.pp,
    }
}

/// `ΔH`, and between position and heading `κ_a r + κ_b J r`; `bend` is `(h, κ)`. `½ F²` and `½ F (2 − F)` are `Ω_a` and `C_b`.
#[inline]
fn curvature(circle: &Circle, swept: &Swept, bend: &Bend) -> Symmetric3 {
    let (way, noise) = (swept.way, &swept.noise);
    let (left, spread) = (way.left(), Plane::new(noise.xx, noise.yy));
    let ((along, along_heading), (across, across_heading)) =
        (parted(bend.along), parted(bend.across));
    let squares = way.times(way) + spread;
    let own = circle.along * squares + circle.across * left.times(left);
    let variances =
        2.0 * (way.times(along) + left.times(across)) + own + circle.sine * spread.swapped();
    let with_heading = along_heading * way + across_heading * left;
    let crossed = way.times(along.swapped()) + left.times(across.swapped());
    Symmetric3 {
        xx: variances.x,
        yy: variances.y,
        xp: with_heading.x,
        yp: with_heading.y,
        xy: (crossed.x + crossed.y) + (circle.along - circle.across) * (way.x * way.y)
            - (circle.sine - circle.along) * noise.xy,
        pp: 0.0,
    }
}

/// `k⁺`; `bend` is `(h, κ)`.
#[inline]
fn bent_further(circle: &Circle, swept: &Swept, bend: &Bend) -> Bend {
    let (way, with_turn) = (swept.way, Plane::new(swept.noise.xp, swept.noise.yp));
    let ((along, along_heading), (across, across_heading)) =
        (parted(bend.along), parted(bend.across));
    let along = along + circle.along * way - circle.sine * with_turn.left();
    let across = across + circle.across * way.left() + circle.along * with_turn;
    Bend {
        along: joined(circle.kept * along, circle.kept * along_heading),
        across: joined(circle.kept * across, circle.kept * across_heading),
    }
}

/// `(h, κ)`
#[inline]
fn parted([x, y, heading]: [f64; 3]) -> (Plane, f64) {
    (Plane::new(x, y), heading)
}

#[inline]
fn joined(position: Plane, heading: f64) -> [f64; 3] {
    [position.x, position.y, heading]
}

impl Map {
    #[inline]
    fn new(by_heading: Plane) -> Self {
        Self {
            by_heading: [by_heading.x, by_heading.y],
        }
    }

    /// `A v`
    #[inline]
    pub(crate) fn apply(&self, [x, y, p]: [f64; 3]) -> [f64; 3] {
        let [ax, ay] = self.by_heading;
        [x + ax * p, y + ay * p, p]
    }

    /// `A G`
    pub(crate) fn after(&self, &Square3([x, y, p]): &Square3) -> Square3 {
        let [ax, ay] = self.by_heading;
        let moved = |row: [f64; 3], by: f64| [0, 1, 2].map(|at| row[at] + by * p[at]);
        Square3([moved(x, ax), moved(y, ay), p])
    }

    /// `G A`
    pub(crate) fn before(&self, Square3(rows): &Square3) -> Square3 {
        let [ax, ay] = self.by_heading;
        Square3(rows.map(|[x, y, p]| [x, y, ax * x + ay * y + p]))
    }

    /// `A P Aᵀ`
    #[inline]
    pub(crate) fn congruence(&self, p: &Symmetric3) -> Symmetric3 {
        let [ax, ay] = self.by_heading;
        let map = Plane::new(ax, ay);
        let before = Plane::new(p.xp, p.yp);
        let after = before + p.pp * map;
        let variances = Plane::new(p.xx, p.yy) + map.times(before + after);
        if variances.x < CANCELLED * p.xx || variances.y < CANCELLED * p.yy {
            return self.congruence_by_columns(p);
        }
        Symmetric3 {
            xx: variances.x,
            yy: variances.y,
            xp: after.x,
            yp: after.y,
            xy: p.xy + ax * p.yp + ay * after.x,
            pp: p.pp,
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotate::rotated;

    /// Over a heading's errors of up to 9σ, by a sum.
    fn mean_of_turned(noise: &Symmetric3, s: f64) -> Symmetric3 {
        let (count, reach) = (4000, 9.0);
        let step = 2.0 * reach / f64::from(count);
        let mut sum = Symmetric3::ZERO;
        for index in 0..=count {
            let z = f64::from(index) * step - reach;
            let weight = step * libm::exp(-0.5 * z * z) / libm::sqrt(core::f64::consts::TAU);
            let (sin, cos) = libm::sincos(z * libm::sqrt(s));
            sum = sum + rotated(noise, sin, cos) * weight;
        }
        sum
    }

    #[test]
    fn noise_is_turned_as_its_mean_over_all_headings_has_it() {
        let noise = [0.04, 0.01, 0.002, 0.01, 0.02, -0.003, 0.002, -0.003, 0.01];
        let noise = Covariance3::from_row_major(noise).unwrap().symmetric();
        for s in [1e-3, 0.3, 2.0] {
            let (found, mean) = (
                turned(&noise, &Circle::of(s, 0.0)),
                mean_of_turned(&noise, s),
            );
            let entries = |it: &Symmetric3| it.rows().into_iter().flatten();
            for (a, b) in entries(&found).zip(entries(&mean)) {
                assert!((a - b).abs() < 1e-15, "{s}: {a} is not {b}");
            }
        }
        let known = Circle::of(0.0, 0.0);
        assert_eq!(turned(&noise, &known), noise);
    }
}
