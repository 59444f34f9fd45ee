//! The weight α ∈ [0, 1] that makes `tr W P⁺` smallest, of what is not a whole pose.
//!
//! With `M = α (1−α) S`, finite at both ends, and `G̃ = G/(1−α) = (P_d Hᵀ + E + α P_i Hᵀ) M⁻¹`, the derivative is `h − g`:
//!
//! ```text
//! g = tr W Q/α²     h = tr W G̃ R_d G̃ᵀ     W = diag(1, 1, L²)
//! ```
//!
//! With `A = P_d Hᵀ + E + α P_i Hᵀ` and `T = M⁻¹ Aᵀ W A M⁻¹`, a 2×2 matrix, both are traces of 2×2 matrices:
//!
//! ```text
//! h = tr R_d T     α² g = tr W P_d − 2 (1−α) tr M⁻¹ Aᵀ W (P_d Hᵀ + E) + (1−α)² tr own T
//! ```
//!
//! Near α = 0 that difference cancels, and g is the sum of squares that Q is made of.
//!
//! It is sought as in [`crate::weight`]: from the end that is nearer, by the root of `√(h/g) − 1`.

use super::columns::Columns;
use super::symmetric::{Symmetric2, apply};
use crate::root::{BEFORE_THE_END, from_zero};
use crate::symmetric::Symmetric3;
use crate::weight::Weights;

/// Of the weight: near an end the gain is in proportion to what is left of it.
const ACCURACY: f64 = 1e-12;

/// Where its search begins.
const LOWEST: [f64; 2] = [BEFORE_THE_END, ACCURACY];

/// Below this weight a difference has lost too many digits.
const CANCELLING: f64 = 1e-2;

/// All of a fusion that does not depend on the weight.
#[derive(Copy, Clone, Debug)]
pub(super) struct Problem {
    pub(super) columns: Columns,
    /// `H P_d Hᵀ + H E + (H E)ᵀ + N`
    pub(super) own: Symmetric2,
    /// `H P_i Hᵀ + R_i`
    independent: Symmetric2,
    /// `R_d`
    pub(super) dependent: Symmetric2,
    /// `P_d Hᵀ + E`
    crossed: [[f64; 2]; 3],
    /// `P_i Hᵀ`
    crossed_independent: [[f64; 2]; 3],
    /// L²
    square_lever: f64,
    /// `tr W P_d`
    trace: f64,
    /// Of `P_d Hᵀ + E` and `P_i Hᵀ`, with W between them: squares and the symmetric part of the product.
    squares: [Symmetric2; 3],
}

impl Problem {
    pub(super) fn new(
        columns: Columns,
        by_state: &[[f64; 3]; 2],
        own_independent: &Symmetric3,
        [independent, dependent]: [Symmetric2; 2],
        lever: f64,
    ) -> Self {
        let square_lever = lever * lever;
        let crossed = columns.crossed();
        let crossed_independent = own_independent.rows().map(|row| apply(by_state, row));
        Self {
            own: columns.seen(),
            trace: columns.trace(square_lever),
            squares: [
                weighted(&crossed, &crossed, square_lever),
                weighted(&crossed, &crossed_independent, square_lever),
                weighted(&crossed_independent, &crossed_independent, square_lever),
            ],
            crossed,
            columns,
            independent: Symmetric2::seen(by_state, own_independent) + independent,
            dependent,
            crossed_independent,
            square_lever,
        }
    }

    /// A multiple of S: `M = (1−α) own + α R_d + α (1−α) (H P_i Hᵀ + R_i)`.
    #[inline]
    pub(super) fn combined(&self, weights: Weights) -> Symmetric2 {
        let Weights { own, received } = weights;
        self.own * received + self.dependent * own + self.independent * (own * received)
    }

    /// `G/(1−α)`, of `M⁻¹`.
    #[inline]
    pub(super) fn gain(&self, weights: Weights, inverse: &Symmetric2) -> [[f64; 2]; 3] {
        core::array::from_fn(|row| {
            let [x, y] = self.crossed[row];
            let [ix, iy] = self.crossed_independent[row];
            inverse.apply([x + weights.own * ix, y + weights.own * iy])
        })
    }

    /// The best weights, of parts that are both there.
    pub(super) fn optimal(&self) -> Weights {
        let middle = self.excess(Weights {
            own: 0.5,
            received: 0.5,
        });
        if middle >= 0.0 {
            let excess = |own: f64| {
                self.excess(Weights {
                    own,
                    received: 1.0 - own,
                })
            };
            let small = from_zero(excess, middle, &LOWEST, ACCURACY);
            return Weights {
                own: small,
                received: 1.0 - small,
            };
        }
        let excess = |received: f64| {
            inverted(self.excess(Weights {
                own: 1.0 - received,
                received,
            }))
        };
        let small = from_zero(excess, inverted(middle), &LOWEST, ACCURACY);
        Weights {
            own: 1.0 - small,
            received: small,
        }
    }

    /// `√(h/g) − 1`
    #[inline]
    fn excess(&self, weights: Weights) -> f64 {
        let Weights { own, received } = weights;
        let m = self.combined(weights);
        let (inverse, scale) = m.up_to_scale();
        let [both, mixed, other] = self.squares;
        let all = both + mixed * (2.0 * own) + other * (own * own);
        let through = inverse.congruence(&all);
        let h = self.dependent.product_trace(&through);
        let g = if own < CANCELLING {
            scale * scale * self.left(weights, &m.inverse())
        } else {
            let gained = inverse.product_trace(&(both + mixed * own));
            let spread = self.own.product_trace(&through);
            scale * (scale * self.trace - 2.0 * received * gained) + received * received * spread
        };
        if g > 0.0 {
            own * libm::sqrt(h / g) - 1.0
        } else {
            h
        }
    }

    /// `tr W Q`, as a sum of squares.
    #[cold]
    fn left(&self, weights: Weights, inverse: &Symmetric2) -> f64 {
        let gain = self.gain(weights, inverse);
        let gain = gain.map(|row| row.map(|it| weights.received * it));
        Columns(self.columns.left(&gain)).trace(self.square_lever)
    }
}

/// The symmetric part of `Aᵀ W B`.
fn weighted(a: &[[f64; 2]; 3], b: &[[f64; 2]; 3], square_lever: f64) -> Symmetric2 {
    let mut sum = Symmetric2::ZERO;
    for (([ax, ay], [bx, by]), weight) in a.iter().zip(b).zip([1.0, 1.0, square_lever]) {
        sum = sum
            + Symmetric2 {
                xx: weight * ax * bx,
                xy: 0.5 * weight * (ax * by + ay * bx),
                yy: weight * ay * by,
            };
    }
    sum
}

/// `√(g/h) − 1` of `√(h/g) − 1`.
fn inverted(excess: f64) -> f64 {
    1.0 / (1.0 + excess) - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::Belief;
    use crate::covariance::Covariance3;
    use crate::honest::{Increments, advance};
    use crate::parts::Parts;
    use crate::pose::Pose;

    /// Of a robot that has driven some way since it knew its heading.
    fn problem() -> Problem {
        let part = Covariance3::diagonal([0.04, 0.01, 0.05]).unwrap();
        let parts = Parts {
            independent: part,
            dependent: part,
        };
        let way = Increments {
            translation: [2.0, 0.3],
            ..Increments::default()
        };
        let start = Belief::gaussian(Pose::new(1.0, 2.0, 0.4), parts);
        let own = advance(&start, &way).belief;
        let (h, z) = (
            [[1.0, 0.0, -0.8], [0.0, 1.0, 2.5]],
            [[2.0, -1.5], [1.5, 2.0]],
        );
        let noise = [
            Symmetric2::outer(0.02, [1.0, 0.5]),
            Symmetric2::outer(0.1, [0.2, 1.0]) + Symmetric2::outer(0.03, [1.0, 0.0]),
        ];
        let independent = own.parts.independent.symmetric();
        Problem::new(Columns::new(&own, &h, &z), &h, &independent, noise, 1.5)
    }

    /// `√(h/g) − 1` as it is written, without traces.
    fn by_definition(problem: &Problem, weights: Weights) -> f64 {
        let inverse = problem.combined(weights).inverse();
        let gain = problem.gain(weights, &inverse);
        let [x, y, heading] = gain.map(|row| problem.dependent.quadratic(row));
        let h = x + y + problem.square_lever * heading;
        let g = problem.left(weights, &inverse) / (weights.own * weights.own);
        libm::sqrt(h / g) - 1.0
    }

    #[test]
    fn traces_are_the_sums_of_squares_that_they_stand_for() {
        let problem = problem();
        for own in [1e-6, 0.009, 0.011, 0.2, 0.7, 0.999] {
            let weights = Weights {
                own,
                received: 1.0 - own,
            };
            let (found, expected) = (problem.excess(weights), by_definition(&problem, weights));
            assert!(
                (found - expected).abs() < 1e-9 * (1.0 + expected.abs()),
                "{own}: {found}"
            );
        }
    }

    #[test]
    fn the_best_weight_is_where_the_derivative_is_zero() {
        let problem = problem();
        let best = problem.optimal();
        assert!(best.own > 0.01 && best.received > 0.01, "{best:?}");
        assert!(problem.excess(best).abs() < 1e-9, "{best:?}");
    }
}
