//! Split covariance intersection of a belief with what is not a whole pose.

use super::columns::{Column, Columns};
use super::innovation::Innovation;
use super::search::Problem;
use super::settings::PositionSettings;
use super::symmetric::Symmetric2;
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::factor::Factor;
use crate::fusion::Fusion;
use crate::gate::accepts;
use crate::honest::Bend;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::symmetric::{Square3, Symmetric3};
use crate::weight::Weights;

/// Stands for zero at the ends, where the other part is there all the same.
const NEXT_TO_ZERO: f64 = 1e-9;

/// `own` after what `innovation` says of it, if the gate accepts; β is the settings' damping ([`PositionSettings::damped`]).
///
/// Where a dependent part is exactly zero it is not divided by its weight, nor is the weight damped: `α = 0` of a belief with neither
/// dependent part nor bend, `α = 1` where `R_d = 0`; of both it is the Kalman filter's update.
#[must_use]
pub fn fuse(own: &Belief, innovation: &Innovation, settings: &PositionSettings) -> Fusion {
    let mut left = Square3::IDENTITY;
    fuse_and_leave(own, innovation, settings, &mut left)
}

/// [`fuse`]; where it accepts, `left` becomes `I − G H`: what is left of the error before.
pub(crate) fn fuse_and_leave(
    own: &Belief,
    innovation: &Innovation,
    settings: &PositionSettings,
    left: &mut Square3,
) -> Fusion {
    let [independent, dependent] =
        [innovation.independent, innovation.dependent].map(|it| Symmetric2::of(&it));
    let problem = Problem::new(
        Columns::of(own, innovation),
        &innovation.by_state,
        &own.parts.independent.symmetric(),
        [independent, dependent],
        settings.heading_lever_m,
    );
    let (alpha, weights) = choose(&problem, settings.damping);
    let inverse = problem.combined(weights).inverse();
    let d2 = weights.own * weights.received * inverse.quadratic(innovation.difference);
    let refused = Fusion {
        belief: *own,
        accepted: false,
        alpha,
        d2,
    };
    if !accepts(d2, settings.gate_of(innovation.numbers)) {
        return refused;
    }
    let gain = problem.gain(weights, &inverse);
    let belief = updated(own, innovation, &problem, weights, &gain);
    if !belief.is_finite() {
        return refused;
    }
    let whole = gain.map(|row| row.map(|it| weights.received * it));
    *left = complement(&whole, &innovation.by_state);
    Fusion {
        belief,
        accepted: true,
        ..refused
    }
}

/// α, and the weights to compute with.
fn choose(problem: &Problem, damping: f64) -> (f64, Weights) {
    let both_whole = Weights {
        own: 1.0,
        received: 1.0,
    };
    if problem.columns.are_nothing() {
        return (0.0, both_whole);
    }
    if problem.dependent.is_zero() {
        return (1.0, both_whole);
    }
    let best = problem.optimal();
    let damping = damping.clamp(0.0, 1.0);
    let own = best.own + (1.0 - damping) * best.received;
    let inside = Weights {
        own: own.max(NEXT_TO_ZERO),
        received: (damping * best.received).max(NEXT_TO_ZERO),
    };
    (own, inside)
}

/// The belief after the gain `(1−α) G̃`.
fn updated(
    own: &Belief,
    innovation: &Innovation,
    problem: &Problem,
    weights: Weights,
    per_weight: &[[f64; 2]; 3],
) -> Belief {
    let gain = per_weight.map(|row| row.map(|it| weights.received * it));
    let left = problem.columns.left(&gain);
    let kept = left
        .iter()
        .map(|it| Symmetric3::outer(it.weight, it.state))
        .fold(Symmetric3::ZERO, |a, b| a + b);
    let received = spread(per_weight, &problem.dependent) * weights.received;
    let dependent = kept * (1.0 / weights.own) + received;
    let independent = rest(
        &own.parts.independent.symmetric(),
        &gain,
        &innovation.by_state,
    ) + spread(&gain, &Symmetric2::of(&innovation.independent));
    let [dx, dy, dphi] =
        gain.map(|[x, y]| x * innovation.difference[0] + y * innovation.difference[1]);
    let Pose { x, y, phi } = own.pose;
    let (before, after) = (own.heading_variance(), independent.pp + dependent.pp);
    let [.., along, across] = left;
    let k = |it: Column| it.state.map(|state| it.weight * state);
    Belief {
        pose: Pose::new(x + dx, y + dy, phi + dphi),
        parts: Parts {
            independent: Covariance3::trusted(&independent),
            dependent: Covariance3::trusted(&dependent),
        },
        bend: Bend {
            along: k(along),
            across: k(across),
        }
        .shrunk(before, after),
    }
}

/// `F P Fᵀ`, `F = I − G H`, a sum of squares.
fn rest(p: &Symmetric3, gain: &[[f64; 2]; 3], by_state: &[[f64; 3]; 2]) -> Symmetric3 {
    let factor = Factor::new(p);
    let complement = complement(gain, by_state);
    complement.columns(&factor).square(&factor)
}

/// `I − G H`
fn complement(gain: &[[f64; 2]; 3], h: &[[f64; 3]; 2]) -> Square3 {
    Square3(core::array::from_fn(|row| {
        core::array::from_fn(|column| {
            let whole = if row == column { 1.0 } else { 0.0 };
            whole - (gain[row][0] * h[0][column] + gain[row][1] * h[1][column])
        })
    }))
}

/// `G A Gᵀ`, a sum of squares.
fn spread(gain: &[[f64; 2]; 3], a: &Symmetric2) -> Symmetric3 {
    let [(d1, first), (d2, second)] = a.columns();
    let through = |[x, y]: [f64; 2]| gain.map(|[gx, gy]| gx * x + gy * y);
    Symmetric3::outer(d1, through(first)) + Symmetric3::outer(d2, through(second))
}
