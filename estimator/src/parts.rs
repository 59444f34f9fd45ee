//! A covariance in its two parts, as it is kept and as it is told to others.

use crate::clip::positive_part;
use crate::covariance::{Covariance3, NotACovariance};
use crate::symmetric::Symmetric3;

/// `P = P_i + P_d`. Both parts are said, so that a reader need not subtract: a difference may lose its sign.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// `P_i`: correlated with nothing.
    pub independent: Covariance3,
    /// `P_d`: may be correlated with anything.
    pub dependent: Covariance3,
}

impl Parts {
    /// Neither part of anything.
    pub const ZERO: Self = Self {
        independent: Covariance3::ZERO,
        dependent: Covariance3::ZERO,
    };

    /// All of it independent.
    #[must_use]
    pub fn independent(covariance: Covariance3) -> Self {
        Self {
            independent: covariance,
            dependent: Covariance3::ZERO,
        }
    }

    /// All of it dependent.
    #[must_use]
    pub fn dependent(covariance: Covariance3) -> Self {
        Self {
            independent: Covariance3::ZERO,
            dependent: covariance,
        }
    }

    /// Of a covariance that comes from elsewhere as a whole, and its independent part: `P_d = P − P_i`, its negative eigenvalues
    /// set to zero.
    #[must_use]
    pub fn of(total: &Covariance3, independent: &Covariance3) -> Self {
        let difference = total.symmetric() - independent.symmetric();
        Self {
            independent: *independent,
            dependent: Covariance3::trusted(&positive_part(&difference)),
        }
    }

    /// From outside, the nine entries of each row by row. The dependent part may have been a difference: it is a covariance to
    /// what is left of the precision of the whole.
    ///
    /// # Errors
    /// What is wrong with the first of them that is none.
    pub fn from_row_major(
        independent: [f64; 9],
        dependent: [f64; 9],
    ) -> Result<Self, NotACovariance> {
        let independent = Covariance3::from_row_major(independent)?;
        let dependent = Covariance3::from_row_major_beside(dependent, &independent)?;
        Ok(Self {
            independent,
            dependent,
        })
    }

    /// Where `P_d` is a difference that lost its sign by more than rounding, without its negative eigenvalues: the cubature
    /// transform of P and `P_i`, each by itself, comes to that where the heading is uncertain.
    #[inline]
    #[must_use]
    pub(crate) fn with_its_sign(&self) -> Self {
        if self.total().contains(&self.independent) {
            return *self;
        }
        let dependent = positive_part(&self.dependent.symmetric());
        Self {
            dependent: Covariance3::trusted(&dependent),
            ..*self
        }
    }

    /// With no variance of the whole below that of `floor`. What is added may be anything: it is dependent.
    #[must_use]
    pub(crate) fn with_floor(&self, floor: [f64; 3]) -> Self {
        let total = self.total();
        let (raised, before) = (total.with_floor(floor).symmetric(), total.symmetric());
        let dependent = self.dependent.symmetric();
        Self {
            dependent: Covariance3::trusted(&Symmetric3 {
                xx: dependent.xx + (raised.xx - before.xx),
                yy: dependent.yy + (raised.yy - before.yy),
                pp: dependent.pp + (raised.pp - before.pp),
                ..dependent
            }),
            ..*self
        }
    }

    /// P, no smaller than its parts.
    #[inline]
    #[must_use]
    pub fn total(&self) -> Covariance3 {
        Covariance3::trusted(&(self.independent.symmetric() + self.dependent.symmetric()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagonal(variances: [f64; 3]) -> Covariance3 {
        Covariance3::diagonal(variances).unwrap()
    }

    #[test]
    fn the_whole_is_the_sum_of_its_parts() {
        let (total, independent) = (diagonal([3.0, 2.0, 1.0]), diagonal([1.0, 2.0, 0.0]));
        let parts = Parts::of(&total, &independent);
        assert_eq!(parts.dependent, diagonal([2.0, 0.0, 1.0]));
        assert_eq!((parts.independent, parts.total()), (independent, total));
    }

    /// Rounding once made −1e-17 of a variance that was shared; a reader that checks it refuses the message.
    #[test]
    fn no_part_loses_its_sign() {
        let (total, independent) = (
            diagonal([0.1, 0.2, 0.3]),
            diagonal([0.1 + 1e-17, 0.2 + 1e-9, 0.1]),
        );
        let parts = Parts::of(&total, &independent);
        let again = Parts::from_row_major(
            parts.independent.to_row_major(),
            parts.dependent.to_row_major(),
        );
        assert_eq!(again, Ok(parts));
        assert!(parts.total().contains(&independent));
    }

    /// The points on a heading known to 1 rad turn by more than a right angle: less of their sine is across.
    #[test]
    fn what_the_cubature_made_less_than_nothing_is_set_to_nothing() {
        use crate::motion::{Motion, propagate};
        let parts = Parts {
            independent: diagonal([1e-4, 1e-4, 0.49]),
            dependent: diagonal([0.0, 0.0, 0.51]),
        };
        let belief = crate::Belief::gaussian(crate::Pose::default(), parts);
        let motion = Motion::Holonomic {
            velocity: [1.0, 0.0, 0.0],
            noise: diagonal([0.0; 3]),
        };
        let moved = |it| propagate(&belief, &motion, 1.0, it).parts;
        let paper = moved(crate::Propagation::Paper);
        assert!(
            !paper.total().contains(&paper.independent),
            "the case is one"
        );
        let kept = paper.with_its_sign();
        assert!(kept.total().contains(&kept.independent) && kept.total().contains(&paper.total()));
        assert_eq!(kept.independent, paper.independent);
        assert_eq!(kept.with_its_sign(), kept);
        let honest = moved(crate::Propagation::Honest);
        assert_eq!(honest.with_its_sign(), honest);
    }

    #[test]
    fn a_floor_adds_what_is_missing_to_the_dependent_part() {
        let parts = Parts {
            independent: diagonal([0.1, 0.2, 0.3]),
            dependent: diagonal([0.1, 0.0, 0.0]),
        };
        let raised = parts.with_floor([0.5, 0.1, 0.3]);
        assert_eq!(raised.independent, parts.independent);
        assert_eq!(raised.total(), diagonal([0.5, 0.2, 0.3]));
    }

    #[test]
    fn what_subtraction_leaves_is_a_part_and_what_is_below_that_is_not() {
        let independent = [0.1, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.1];
        let of = |variance| {
            let mut dependent = [0.0; 9];
            (dependent[0], dependent[1], dependent[3]) = (variance, 1e-17, 1e-17);
            Parts::from_row_major(independent, dependent)
        };
        assert!(of(-1e-17).is_ok() && of(0.0).is_ok());
        assert_eq!(of(-1e-6), Err(NotACovariance::NotPositiveSemidefinite));
    }
}
