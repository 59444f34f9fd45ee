//! What a measurement leaves of the bend.
//!
//! With the gain W and the heading's variance s before and s⁺ after:
//!
//! ```text
//! k_a⁺ = ϱ² (I − W) k_a      k_b⁺ = ϱ³ (I − W) k_b      ϱ = min(1, s⁺/s), 1 where s = 0
//! ```
//!
//! Not zero: where weak measurements come often, that would bring the forgetting back at their rate. A good one makes the bend
//! vanish by itself. As `Ω_a ~ s²` and `Ω_b ~ s³`, `[[P_d, K_H], [K_Hᵀ, Ω]]` stays positive semidefinite, and with it `P_d`.

use super::Bend;
use crate::factor::Factor;
use crate::symmetric::{Square3, Symmetric3};

/// `P_d` and `K_H` after `complement`, `I − W`, of them.
///
/// What the dependent part loses to rounding, a direction in which next to nothing of it is left above all, the bend loses with it:
/// else the next step would take from the part what it does not have, and that may be much of what a good fix leaves.
#[inline]
pub(crate) fn left(
    dependent: &Symmetric3,
    bend: &Bend,
    complement: &Square3,
) -> (Symmetric3, Bend) {
    let factor = Factor::new(dependent);
    let columns = complement.columns(&factor);
    let bend = bend.mapped(|k| columns.apply(factor.held(dependent, k)));
    (columns.square(&factor), bend)
}

impl Bend {
    /// Of `(I − W) K_H`, after a measurement that took the heading's variance from `before` to `after` \[rad²\].
    #[inline]
    pub(crate) fn shrunk(&self, before: f64, after: f64) -> Self {
        let ratio = if after < before { after / before } else { 1.0 };
        let square = ratio * ratio;
        let cube = square * ratio;
        Self {
            along: self.along.map(|it| square * it),
            across: self.across.map(|it| cube * it),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEND: Bend = Bend {
        along: [1.0, 2.0, 3.0],
        across: [4.0, 5.0, 6.0],
    };

    #[test]
    fn it_shrinks_with_the_headings_variance_and_never_grows() {
        let halved = BEND.shrunk(0.2, 0.1);
        assert_eq!(halved.along, BEND.along.map(|it| 0.25 * it));
        assert_eq!(halved.across, BEND.across.map(|it| 0.125 * it));
        for (before, after) in [(0.0, 0.0), (0.1, 0.1), (0.1, 0.2)] {
            assert_eq!(BEND.shrunk(before, after), BEND);
        }
    }
}
