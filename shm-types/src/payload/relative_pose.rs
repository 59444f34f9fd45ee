//! A robot's sighting of another.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::Matrix;
use crate::{Limits, Reject};

/// `coloc/<robot>/relative_pose`: this robot's sighting of another.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.RelativePose.v1")]
pub struct RelativePose {
    /// Stamp, session and sequence of the laser driver.
    pub header: Header,
    /// Team number of the robot that was seen.
    pub observed: u16,
    /// Zero.
    pub reserved: [u8; 6],
    /// `[δx, δy, δφ]` of the observed robot in this robot's body frame (m, m, rad).
    pub pose: [f64; 3],
    /// R of `pose`, 3×3, full row-major.
    pub covariance: [f64; 9],
}

layout!(RelativePose, 128; header: 0, observed: 24, reserved: 26, pose: 32, covariance: 56);

impl RelativePose {
    /// Checks everything that can be known of this message alone. The angle may be any finite number.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Matrix::<3>::from_row_major(self.covariance).check_covariance()?;
        limits.check_other(self.observed)?;
        limits.check_time(&self.header)
    }
}
