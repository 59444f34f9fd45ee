//! A pose that a person or a map says.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::Matrix;
use crate::{Limits, Reject};

/// `coloc/<robot>/pose`: where this robot is, as a person or a map says it.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Pose.v1")]
pub struct Pose {
    /// When the pose was right, by which clock, and which person or map says it.
    pub header: Header,
    /// [`Self::SET`]: a person says so, and it is believed from then on. [`Self::SAID`]: a map or a localiser says so: one more
    /// source that is judged like all others. Others are refused.
    pub set: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 7],
    /// `[x, y, φ]` in the common frame (m, m, rad).
    pub pose: [f64; 3],
    /// Its covariance, 3×3, full row-major (m², m·rad, rad²). It may be singular, but no variance may be zero. How its error
    /// depends on anything else that is known of the robot is taken to be unknown.
    pub covariance: [f64; 9],
}

layout!(Pose, 144; header: 0, set: 40, reserved: 41, pose: 48, covariance: 72);

impl Pose {
    /// `set` of a pose that is one more source's word.
    pub const SAID: u8 = 0;
    /// `set` of a pose that is believed.
    pub const SET: u8 = 1;

    /// Checks everything that can be known of this message alone. The angle may be any finite number.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Matrix::<3>::from_row_major(self.covariance).check_covariance()?;
        self.validate_beside_covariance(limits)
    }

    /// All of [`Self::validate`], except whether it has a covariance: for who makes something of it that checks it.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate_beside_covariance(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Matrix::<3>::from_row_major(self.covariance).check_variances()?;
        Limits::check_supported(self.set <= Self::SET && self.reserved == [0; 7])?;
        limits.check_time(&self.header)
    }
}
