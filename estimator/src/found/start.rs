//! What is known at the start.

use super::cover::nowhere;
use crate::belief::Belief;
use crate::covariance::Covariance2;

/// What is known at the start.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Start {
    /// A belief.
    Known(Belief),
    /// A position and its covariance \[m, m²\], and nothing of the heading.
    Position([f64; 2], Covariance2),
    /// Nothing.
    Unknown,
}

impl Start {
    /// The belief to begin with; of no meaning where there is none.
    #[must_use]
    pub fn belief(&self) -> Belief {
        match self {
            Self::Known(belief) => *belief,
            Self::Position(position, covariance) => nowhere(Some((*position, covariance.matrix()))),
            Self::Unknown => nowhere(None),
        }
    }

    pub(crate) fn is_known(&self) -> bool {
        matches!(self, Self::Known(_))
    }
}
