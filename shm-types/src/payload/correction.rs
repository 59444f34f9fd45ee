//! What a round does to this robot's belief.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use super::shared::check_belief;
use crate::layout::layout;
use crate::{Limits, Reject};

/// `coloc/<robot>/correction`: what the team's rounds do to this robot's belief. Of its own `coloc-rounds`, for `colocd` with `fusion.mode = "rounds"`, which
/// takes a correction only if a round can have made it of what was shared.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Correction.v1")]
pub struct Correction {
    /// When it was said.
    pub header: Header,
    /// With [`Self::CORRECT`] the slot that it is of; with [`Self::UNDO`] the slot of the last round that stands.
    pub slot: u64,
    /// `x̂⁺` at the slot (m, m, rad).
    pub pose: [f64; 3],
    /// `P⁺`, row by row (m², m·rad, rad²).
    pub covariance: [f64; 9],
    /// Of the block bound, 1 where nobody joined.
    pub factor: f64,
    /// [`Self::CORRECT`] and those below; all numbers of the others are zero.
    pub kind: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 7],
}

layout!(Correction, 160; header: 0, slot: 40, pose: 48, covariance: 72, factor: 144, kind: 152, reserved: 153);

impl Correction {
    /// `kind`: the belief at the slot is replaced.
    pub const CORRECT: u8 = 0;
    /// `kind`: what later rounds did is taken back.
    pub const UNDO: u8 = 1;
    /// `kind`: what all rounds did is taken back.
    pub const UNDO_ALL: u8 = 2;
    /// `kind`: the robot takes part from now on, and shares nothing that is known.
    pub const JOIN: u8 = 3;
    /// `kind`: it takes no part any more.
    pub const LEAVE: u8 = 4;

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Limits::check_finite(&[self.factor])?;
        check_belief(self.kind == Self::CORRECT, &self.covariance)?;
        Limits::check_supported(self.kind <= Self::LEAVE && self.reserved == [0; 7])?;
        limits.check_time(&self.header)
    }
}
