//! What a measurement at an antenna leaves at the body.
//!
//! To move a belief to the antenna adds the lever's bend to `P_d`, to move it back takes it away. Where `P_d` is small beside it, that would
//! leave rounding, of either sign. So way, measurement and way back are one map of the belief's error and of w, what is not linear in
//! the heading of its direction: `x⁺ = T_x x + T_w w + L' ε`, `w⁺ = F w + ε`. With L and L' the lever there and back, C what the
//! measurement leaves, A and A' the maps of both ways, `F = diag(ϱ², ϱ³)`, and the columns of `[[P_d, K_H], [K_Hᵀ, Ω]]`,
//!
//! ```text
//! T_x = A' C A      T_w = A' C L + L' F      E = Cov ε = Ω⁺ − F Ω F      P_d = Σ d l lᵀ      K_H = Σ d l mᵀ      Ω = Σ d m mᵀ + Ω_r
//! P_d⁺ = Σ d c cᵀ + T_w Ω_r T_wᵀ + L' E L'ᵀ      c = T_x l + T_w m      K_H⁺ = Σ d c mᵀ F + T_w Ω_r F + L' E
//! ```
//!
//! a sum of squares, which is what it was where nothing is learnt.

use super::{Bend, Circle, Map};
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::factor::{Factor, pivot};
use crate::symmetric::{Square3, Symmetric3};

/// A way there, a measurement, a way back.
pub(crate) struct ThereAndBack<'a> {
    /// At the body, before.
    pub(crate) own: &'a Belief,
    /// `[forward, left]` \[m\]
    pub(crate) lever: [f64; 2],
    pub(crate) there: &'a Map,
    /// At the antenna: `I − W H`
    pub(crate) complement: &'a Square3,
    pub(crate) back: &'a Map,
}

impl ThereAndBack<'_> {
    /// `body`, which it led to, with `P_d` and the bend as they are.
    pub(crate) fn exact(&self, body: &Belief) -> Belief {
        let own = self.own.parts.dependent.symmetric();
        let (before, after) = (self.own.heading_variance(), body.heading_variance());
        let ratio = if after < before { after / before } else { 1.0 };
        let shrunk = [ratio * ratio, ratio * ratio * ratio];
        let [circle, left] = [before, after].map(|s| Circle::of(s, 0.0));
        let swings = self.swings(body, shrunk);
        let explained = Explained::new(&own, &self.own.bend, &circle);
        let came = [
            left.along - shrunk[0] * shrunk[0] * circle.along,
            left.across - shrunk[1] * shrunk[1] * circle.across,
        ];
        let all = self.back.after(&self.complement_there());
        let mut sum = Sum {
            covariance: Symmetric3::ZERO,
            along: [0.0; 3],
            across: [0.0; 3],
        };
        for at in 0..3 {
            let m = explained.by_column[at];
            let column = plus(all.apply(explained.columns[at]), swings.of_direction(m));
            sum.add(
                explained.weights[at],
                column,
                [m[0] * shrunk[0], m[1] * shrunk[1]],
            );
        }
        for (weight, m) in explained.rest {
            sum.add(
                weight,
                swings.of_direction(m),
                [m[0] * shrunk[0], m[1] * shrunk[1]],
            );
        }
        sum.add(came[0].max(0.0), swings.back[0], [1.0, 0.0]);
        sum.add(came[1].max(0.0), swings.back[1], [0.0, 1.0]);
        let mut exact = *body;
        exact.parts.dependent = Covariance3::trusted(&sum.covariance);
        exact.bend = Bend {
            along: sum.along,
            across: sum.across,
        };
        exact
    }

    /// `C A`
    fn complement_there(&self) -> Square3 {
        self.there.before(self.complement)
    }

    /// The columns of `T_w` and of `L'`.
    fn swings(&self, body: &Belief, shrunk: [f64; 2]) -> Swings {
        let there = swung(self.own.pose.phi, self.lever);
        let [forward, left] = self.lever;
        let back = swung(body.pose.phi, [-forward, -left]);
        let both = [0, 1].map(|at| {
            let seen = self.back.apply(self.complement.apply(there[at]));
            plus(seen, back[at].map(|it| shrunk[at] * it))
        });
        Swings { both, back }
    }
}

/// What a direction moves, along and across.
struct Swings {
    /// `T_w`
    both: [[f64; 3]; 2],
    /// `L'`
    back: [[f64; 3]; 2],
}

impl Swings {
    fn of_direction(&self, [along, across]: [f64; 2]) -> [f64; 3] {
        let [a, b] = self.both;
        plus(a.map(|it| along * it), b.map(|it| across * it))
    }
}

/// r and J r of a lever at a heading.
fn swung(heading: f64, [forward, left]: [f64; 2]) -> [[f64; 3]; 2] {
    let (sin, cos) = libm::sincos(heading);
    let [x, y] = [cos * forward - sin * left, sin * forward + cos * left];
    [[x, y, 0.0], [-y, x, 0.0]]
}

/// The columns of `[[P_d, K_H], [K_Hᵀ, Ω]]`.
struct Explained {
    /// d
    weights: [f64; 3],
    /// l
    columns: [[f64; 3]; 3],
    /// m
    by_column: [[f64; 2]; 3],
    /// `Ω_r`
    rest: [(f64, [f64; 2]); 2],
}

impl Explained {
    fn new(dependent: &Symmetric3, bend: &Bend, circle: &Circle) -> Self {
        let factor = Factor::new(dependent);
        let [along, across] = [bend.along, bend.across].map(|k| factor.held(dependent, k));
        let weights = factor.pivots;
        let share = |y: f64, weight: f64| if weight > 0.0 { y / weight } else { 0.0 };
        let by_column = [0, 1, 2].map(|at| {
            [
                share(along[at], weights[at]),
                share(across[at], weights[at]),
            ]
        });
        let [l21, l31, l32] = factor.lower;
        let mut rest = [circle.along, 0.0, circle.across];
        for ([a, b], weight) in by_column.iter().zip(weights) {
            rest[0] -= weight * a * a;
            rest[1] -= weight * a * b;
            rest[2] -= weight * b * b;
        }
        let (first, reciprocal) = pivot(rest[0], circle.along);
        let slope = rest[1] * reciprocal;
        let (second, _) = pivot(rest[2] - slope * rest[1], circle.across);
        Self {
            weights,
            columns: [[1.0, l21, l31], [0.0, 1.0, l32], [0.0, 0.0, 1.0]],
            by_column,
            rest: [(first, [1.0, slope]), (second, [0.0, 1.0])],
        }
    }
}

/// `P_d⁺` and `K_H⁺` while they are summed.
struct Sum {
    covariance: Symmetric3,
    along: [f64; 3],
    across: [f64; 3],
}

impl Sum {
    fn add(&mut self, weight: f64, column: [f64; 3], [along, across]: [f64; 2]) {
        self.covariance = self.covariance + Symmetric3::outer(weight, column);
        self.along = plus(self.along, column.map(|it| weight * along * it));
        self.across = plus(self.across, column.map(|it| weight * across * it));
    }
}

fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
