//! A robot's pose as a neighbour sees it.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::Matrix;
use crate::{Limits, Reject};

/// `coloc/<robot>/neighbour`: pose of this robot as a neighbour sees it.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Neighbour.v1")]
pub struct Neighbour {
    /// Stamp, session and sequence of the sending robot.
    pub header: Header,
    /// Team number of the sender.
    pub sender: u16,
    /// Zero.
    pub reserved: [u8; 6],
    /// `[x, y, φ]` of the receiving robot in the common frame (m, m, rad).
    pub pose: [f64; 3],
    /// R*, 3×3, full row-major.
    pub total: [f64; 9],
    /// `R*_i`, the part of `total` that is independent of everything else, 3×3, full row-major.
    pub independent: [f64; 9],
}

layout!(Neighbour, 200; header: 0, sender: 24, reserved: 26, pose: 32, total: 56, independent: 128);

impl Neighbour {
    /// Checks everything that can be known of this message alone. The angle may be any finite number.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        let total = Matrix::<3>::from_row_major(self.total);
        Matrix::check_split(&total, &Matrix::<3>::from_row_major(self.independent))?;
        limits.check_other(self.sender)?;
        limits.check_time(&self.header)
    }
}
