//! The weight α ∈ [0, 1] that makes `tr W P⁺` smallest, of what is not a whole pose.
//!
//! With `M = α (1−α) S`, finite at both ends, and `G̃ = G/(1−α) = (P_d Hᵀ + E + α P_i Hᵀ) M⁻¹`, the derivative is `h − g`:
//!
//! ```text
//! g = tr W Q/α²     h = tr W G̃ R_d G̃ᵀ     W = diag(1, 1, L²)
//! ```
//!
//! It is sought as in [`crate::weight`]: from the end that is nearer, by the root of `√(h/g) − 1`.

use super::columns::Columns;
use super::symmetric::{Symmetric2, apply};
use crate::root::bracketed;
use crate::symmetric::Symmetric3;
use crate::weight::Weights;

/// Of the weight: near an end the gain is in proportion to what is left of it.
const ACCURACY: f64 = 1e-12;

/// Where the search looks for a change of sign before it goes to the end.
const BEFORE_THE_END: f64 = 1e-4;

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
}

impl Problem {
    pub(super) fn new(
        columns: Columns,
        by_state: &[[f64; 3]; 2],
        own_independent: &Symmetric3,
        [independent, dependent]: [Symmetric2; 2],
        lever: f64,
    ) -> Self {
        Self {
            own: columns.seen(),
            crossed: columns.crossed(),
            columns,
            independent: Symmetric2::seen(by_state, own_independent) + independent,
            dependent,
            crossed_independent: own_independent.rows().map(|row| apply(by_state, row)),
            square_lever: lever * lever,
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
            let small = smaller(middle, |own| {
                self.excess(Weights {
                    own,
                    received: 1.0 - own,
                })
            });
            return Weights {
                own: small,
                received: 1.0 - small,
            };
        }
        let small = smaller(inverted(middle), |received| {
            inverted(self.excess(Weights {
                own: 1.0 - received,
                received,
            }))
        });
        Weights {
            own: 1.0 - small,
            received: small,
        }
    }

    /// `√(h/g) − 1`
    #[inline]
    fn excess(&self, weights: Weights) -> f64 {
        let gain = self.gain(weights, &self.combined(weights).inverse());
        let [x, y, heading] = gain.map(|row| self.dependent.quadratic(row));
        let h = x + y + self.square_lever * heading;
        let left = self
            .columns
            .left(&gain.map(|row| row.map(|it| weights.received * it)));
        let g = left
            .iter()
            .map(|it| {
                let [x, y, heading] = it.state.map(|it| it * it);
                it.weight * (x + y + self.square_lever * heading)
            })
            .sum::<f64>()
            / (weights.own * weights.own);
        if g > 0.0 { libm::sqrt(h / g) - 1.0 } else { h }
    }
}

/// `√(g/h) − 1` of `√(h/g) − 1`.
fn inverted(excess: f64) -> f64 {
    1.0 / (1.0 + excess) - 1.0
}

/// The weight up to ½ at which `excess` is zero; `middle` is its value at ½.
fn smaller(middle: f64, excess: impl Fn(f64) -> f64) -> f64 {
    let mut high = (0.5, middle);
    for weight in [BEFORE_THE_END, ACCURACY] {
        let low = (weight, excess(weight));
        if low.1 < 0.0 {
            return bracketed(excess, low, high, ACCURACY);
        }
        high = low;
    }
    0.0
}
