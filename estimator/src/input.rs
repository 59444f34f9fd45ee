//! What a tick hands to the estimator: valid data only, each with the stamp at which it was measured.

use crate::kind::Measurement;
use crate::stamp::Stamp;

/// Everything that reached the robot since the tick before.
#[derive(Copy, Clone, Debug, Default)]
pub struct TickInputs<'a> {
    /// The tick's own stamp: what the estimate will be stamped with.
    pub stamp: Stamp,
    /// Of all kinds, in any order.
    pub measurements: &'a [Measurement],
}
