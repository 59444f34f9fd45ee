//! A covariance in its two parts, as split covariance intersection uses it.

use crate::clip::positive_part;
use crate::factor::Factor;
use crate::parts::Parts;
use crate::symmetric::Symmetric3;

/// A dependent part up to this part of the total, entry by entry, is the rounding of zero.
const NOTHING: f64 = 1e-12;

/// `P = P_d + P_i`, both positive semidefinite.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Split {
    /// `P_d`: may be correlated with anything.
    pub(crate) dependent: Symmetric3,
    /// `P_i`: correlated with nothing.
    pub(crate) independent: Symmetric3,
    /// `P_d = 0`.
    pub(crate) is_independent: bool,
}

impl Split {
    /// `P_d` without what is below zero by more than rounding: so it may come from outside, or from the paper's difference.
    #[inline]
    pub(crate) fn new(parts: &Parts) -> Self {
        let (dependent, independent) = (parts.dependent.symmetric(), parts.independent.symmetric());
        let is_independent = is_nothing(&dependent, &(dependent + independent));
        let dependent = if is_independent {
            Symmetric3::ZERO
        } else {
            positive_part(&dependent)
        };
        Self {
            dependent,
            independent,
            is_independent,
        }
    }

    /// `P_d + w P_i = w P₁`: the bound that w gives, times w, so that it is finite at w = 0.
    #[inline]
    pub(crate) fn bound(&self, weight: f64) -> Symmetric3 {
        self.dependent + self.independent * weight
    }

    /// With headings in units of 1/`lever` rad: what a robot `lever` away moves by.
    #[inline]
    pub(crate) fn with_heading_in_metres(&self, lever: f64) -> Self {
        let scaled = |part: &Symmetric3| Symmetric3 {
            xp: part.xp * lever,
            yp: part.yp * lever,
            pp: part.pp * (lever * lever),
            ..*part
        };
        Self {
            dependent: scaled(&self.dependent),
            independent: scaled(&self.independent),
            is_independent: self.is_independent,
        }
    }

    /// Whether `P_d/w` leaves nothing of any coordinate as w goes to zero.
    pub(crate) fn is_regular(&self) -> bool {
        Factor::new(&self.dependent).is_regular(&self.dependent)
    }
}

/// `|D_ij| ≤ 1e-12 √(T_ii T_jj)`
fn is_nothing(d: &Symmetric3, t: &Symmetric3) -> bool {
    let within = |d: f64, ti: f64, tj: f64| d * d <= NOTHING * NOTHING * ti * tj;
    within(d.xx, t.xx, t.xx)
        && within(d.yy, t.yy, t.yy)
        && within(d.pp, t.pp, t.pp)
        && within(d.xy, t.xx, t.yy)
        && within(d.xp, t.xx, t.pp)
        && within(d.yp, t.yy, t.pp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance3;

    fn split(independent: [f64; 3], dependent: [f64; 3]) -> Split {
        let [independent, dependent] = [independent, dependent].map(|[xx, yy, pp]| {
            Covariance3::trusted(&Symmetric3 {
                xx,
                yy,
                pp,
                ..Symmetric3::ZERO
            })
        });
        Split::new(&Parts {
            independent,
            dependent,
        })
    }

    #[test]
    fn rounding_is_no_dependent_part() {
        assert!(split([1.0, 1e-8, 0.0], [1e-13, 0.0, 0.0]).is_independent);
        assert!(!split([1.0, 1e-8, 0.0], [0.0, 1e-18, 0.0]).is_independent);
    }

    #[test]
    fn a_variance_below_zero_is_clipped() {
        let split = split([0.5, 1.1, 0.5], [0.5, -0.1, 0.5]);
        assert_eq!(split.dependent.yy, 0.0);
        assert_eq!((split.dependent.xx, split.dependent.pp), (0.5, 0.5));
    }
}
