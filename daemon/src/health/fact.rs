//! What can come of a source: that is what its health is decided from.

use coloc_estimator::Stamp;

/// About one source's inputs.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Fact {
    /// A valid one came, measured at this moment. What becomes of it is another fact.
    Valid(Stamp),
    /// Valid ones changed the belief, or were told on.
    Passed {
        /// How many.
        count: u64,
        /// How far the last one was off, if it met a gate.
        d2: Option<f64>,
    },
    /// A valid one did not.
    Refused {
        /// How far it was off, if it was beyond the gate.
        d2: Option<f64>,
    },
    /// One came that is no valid sample.
    Invalid,
    /// One came again, or a newer one stands for it: it says nothing about how its source is doing.
    Repeated,
}

impl Fact {
    /// How far it was off, if it was beyond the gate.
    #[must_use]
    pub fn gated(self) -> Option<f64> {
        match self {
            Self::Refused { d2 } => d2,
            _ => None,
        }
    }
}
