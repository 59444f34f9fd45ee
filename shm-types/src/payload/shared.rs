//! What a robot shares at a slot with its own process that makes rounds.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::Matrix;
use crate::{Limits, Reject};

/// `coloc/<robot>/shared`: what is believed at a slot of the common clock, and how what the robot shares with others has changed since its last
/// round. Of `colocd` with `fusion.mode = "rounds"`, for the robot's own `coloc-rounds`.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Shared.v1")]
pub struct Shared {
    /// When the slot begins, by which clock; `source` is the robot's team number.
    pub header: Header,
    /// The slot's number: when it begins, over its length.
    pub slot: u64,
    /// With [`Self::SINCE`] the slot of its last round, with [`Self::JOINING`] the first one at which it joins; else zero.
    pub since: u64,
    /// `[x, y, φ]` in the common frame (m, m, rad).
    pub pose: [f64; 3],
    /// P, row by row (m², m·rad, rad²).
    pub covariance: [f64; 9],
    /// Ψ, row by row.
    pub psi: [f64; 9],
    /// [`Self::APART`], [`Self::NOWHERE`], [`Self::JOINING`] or [`Self::SINCE`]. In the first two there are no numbers.
    pub standing: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 7],
}

layout!(Shared, 232; header: 0, slot: 40, since: 48, pose: 56, covariance: 80, psi: 152, standing: 224, reserved: 225);

impl Shared {
    /// `standing`: it takes no part in rounds.
    pub const APART: u8 = 0;
    /// `standing`: it is not known where the robot is.
    pub const NOWHERE: u8 = 1;
    /// `standing`: what it shares with others is unknown.
    pub const JOINING: u8 = 2;
    /// `standing`: a round was its last.
    pub const SINCE: u8 = 3;

    /// Whether there is a belief in it.
    #[must_use]
    pub fn is_belief(&self) -> bool {
        self.standing >= Self::JOINING
    }

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Limits::check_finite(&self.psi)?;
        check_belief(self.is_belief(), &self.covariance)?;
        let is_known = self.standing <= Self::SINCE && self.reserved == [0; 7];
        Limits::check_supported(is_known)?;
        limits.check_member(self.header.source)?;
        limits.check_time(&self.header)
    }
}

/// Of what is one: a covariance with no variance that is zero.
pub(super) fn check_belief(is_one: bool, covariance: &[f64; 9]) -> Result<(), Reject> {
    let covariance = Matrix::<3>::from_row_major(*covariance);
    covariance.check_covariance()?;
    if is_one {
        covariance.check_variances()?;
    }
    Ok(())
}
