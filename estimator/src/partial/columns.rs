//! What the belief's dependent part is made of, in the state and in what is seen.

use super::innovation::Innovation;
use super::symmetric::{Symmetric2, apply};
use crate::belief::Belief;
use crate::factor::Factor;
use crate::honest::Circle;
use crate::symmetric::Symmetric3;

/// A variance of w below this is none: its reciprocal could not be computed with.
const NOTHING: f64 = 1e-200;

/// An error of variance `weight`: `state` of it is in `[x, y, φ]`, `seen` in ν.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Column {
    pub(super) weight: f64,
    pub(super) state: [f64; 3],
    pub(super) seen: [f64; 2],
}

/// Three of what the direction does not explain of `P_d`, then those of the direction, along and across.
#[derive(Copy, Clone, Debug)]
pub(super) struct Columns(pub(super) [Column; 5]);

impl Columns {
    /// Of `own`, for what sees `by_state` of it and `by_direction` of what is not linear of its direction.
    pub(super) fn new(
        own: &Belief,
        by_state: &[[f64; 3]; 2],
        by_direction: &[[f64; 2]; 2],
    ) -> Self {
        let circle = Circle::of(own.heading_variance(), 0.0);
        let (sin, cos) = libm::sincos(own.pose.phi);
        let direction = |weight: f64, k: [f64; 3], [x, y]: [f64; 2]| {
            if weight < NOTHING {
                return Column::default();
            }
            let state = k.map(|it| it / weight);
            let [a, b] = apply(by_state, state);
            let [[ax, ay], [bx, by]] = *by_direction;
            Column {
                weight,
                state,
                seen: [a + (ax * x + ay * y), b + (bx * x + by * y)],
            }
        };
        let along = direction(circle.along, own.bend.along, [cos, sin]);
        let across = direction(circle.across, own.bend.across, [-sin, cos]);
        let explained = |it: &Column| Symmetric3::outer(it.weight, it.state);
        let rest = own.parts.dependent.symmetric() - explained(&along) - explained(&across);
        let [first, second, third] = unexplained(&rest, by_state);
        Self([first, second, third, along, across])
    }

    pub(super) fn of(own: &Belief, innovation: &Innovation) -> Self {
        Self::new(own, &innovation.by_state, &innovation.by_direction)
    }

    /// `H P_d Hᵀ + H E + (H E)ᵀ + N`
    #[inline]
    pub(super) fn seen(&self) -> Symmetric2 {
        let outer = |it: &Column| Symmetric2::outer(it.weight, it.seen);
        self.0
            .iter()
            .map(outer)
            .fold(Symmetric2::ZERO, |a, b| a + b)
    }

    /// `P_d Hᵀ + E`
    #[inline]
    pub(super) fn crossed(&self) -> [[f64; 2]; 3] {
        let mut sum = [[0.0; 2]; 3];
        for it in &self.0 {
            for (row, state) in sum.iter_mut().zip(it.state) {
                row[0] += it.weight * state * it.seen[0];
                row[1] += it.weight * state * it.seen[1];
            }
        }
        sum
    }

    /// `tr W Σ d_j c_j c_jᵀ`, W = diag(1, 1, L²).
    pub(super) fn trace(&self, square_lever: f64) -> f64 {
        let of = |it: &Column| {
            let [x, y, heading] = it.state.map(|it| it * it);
            it.weight * (x + y + square_lever * heading)
        };
        self.0.iter().map(of).sum()
    }

    /// The state's errors once the gain `G` has acted: `c_j − G b_j`.
    #[inline]
    pub(super) fn left(&self, gain: &[[f64; 2]; 3]) -> [Column; 5] {
        self.0.map(|it| Column {
            state: core::array::from_fn(|row| {
                it.state[row] - (gain[row][0] * it.seen[0] + gain[row][1] * it.seen[1])
            }),
            ..it
        })
    }

    /// Whether there is neither a dependent part nor a bend.
    #[inline]
    pub(super) fn are_nothing(&self) -> bool {
        self.0.iter().all(Column::is_nothing)
    }
}

impl Column {
    fn is_nothing(&self) -> bool {
        let mut numbers = self.state.iter().chain(&self.seen);
        self.weight == 0.0 || numbers.all(|it| *it == 0.0)
    }
}

#[inline]
fn unexplained(rest: &Symmetric3, by_state: &[[f64; 3]; 2]) -> [Column; 3] {
    let Factor {
        lower: [l21, l31, l32],
        pivots,
        ..
    } = Factor::new(rest);
    let columns = [[1.0, l21, l31], [0.0, 1.0, l32], [0.0, 0.0, 1.0]];
    core::array::from_fn(|index| Column {
        weight: pivots[index],
        state: columns[index],
        seen: apply(by_state, columns[index]),
    })
}
