//! What is learnt of the own pose, before it is fused.

use super::symmetric::Symmetric2;
use crate::covariance::Covariance2;

/// How much is said.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Numbers {
    /// The second row is none.
    One,
    /// A position.
    Two,
}

/// `ν = H δx + Z w + n`: how far what was said is from what was believed, and what of the own error is in it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Innovation {
    /// How many of its rows there are.
    pub numbers: Numbers,
    /// ν \[m; of a bearing alone rad\]
    pub difference: [f64; 2],
    /// H, its rows over `[x, y, φ]`.
    pub by_state: [[f64; 3]; 2],
    /// Z, its rows over what is not linear in φ of `(cos φ, sin φ)`, in the axes of the common frame.
    pub by_direction: [[f64; 2]; 2],
    /// `R_i` \[m²\]
    pub independent: Covariance2,
    /// `R_d` \[m²\]
    pub dependent: Covariance2,
}

/// Of a single number: the other row says nothing, and its noise is any.
const NO_ROW: Symmetric2 = Symmetric2 {
    xx: 0.0,
    xy: 0.0,
    yy: 1.0,
};

impl Innovation {
    /// Of one number, with its rows of H and Z and its variances.
    pub(super) fn of_number(
        difference: f64,
        by_state: [f64; 3],
        by_direction: [f64; 2],
        [independent, dependent]: [f64; 2],
    ) -> Self {
        let of = |variance: f64| Symmetric2 {
            xx: variance,
            ..Symmetric2::ZERO
        };
        Self {
            numbers: Numbers::One,
            difference: [difference, 0.0],
            by_state: [by_state, [0.0; 3]],
            by_direction: [by_direction, [0.0; 2]],
            independent: (of(independent) + NO_ROW).covariance(),
            dependent: of(dependent).covariance(),
        }
    }
}
