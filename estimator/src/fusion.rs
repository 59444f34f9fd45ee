//! Algorithm 3: split covariance intersection of the own belief with a neighbour's word \[30–37\].

use crate::belief::Belief;
use crate::convert::GlobalPose;
use crate::settings::FusionSettings;

/// Result of [`fuse`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Fusion {
    /// The belief afterwards; the one before, bit for bit, if the gate refused.
    pub belief: Belief,
    /// Whether the pose passed the gate.
    pub accepted: bool,
    /// The weight α ∈ [0, 1] of the update, after damping.
    pub alpha: f64,
    /// Normalised innovation squared, at the weight that [`FusionSettings::gate_weight`] names.
    pub d2: f64,
}

/// Algorithm 3: `own` after hearing `received`.
#[must_use]
pub fn fuse(own: &Belief, received: &GlobalPose, settings: &FusionSettings) -> Fusion {
    let _ = (own, received, settings);
    unimplemented!()
}
