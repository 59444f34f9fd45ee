//! How another robot moved, for who tracks it.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::{Matrix, all_zero};
use crate::{Limits, Reject};

/// `coloc/<robot>/increment`: how another robot moved from `start_ns` to the stamp by its own wheels, or at which bearing it saw this one at the
/// stamp. For `coloc-track`; `colocd` does not hear it.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Increment.v1")]
pub struct Increment {
    /// When the motion ended, or this robot was seen, by which clock; `source` is the other robot's team number.
    pub header: Header,
    /// [`Self::BEARING`], or zero.
    pub flags: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 7],
    /// When the motion began (ns of the header's clock). The same as the stamp: nothing is said of motion, and all its numbers are zero.
    pub start_ns: i64,
    /// `[x, y, φ]` of the other robot's body at the end, in its body frame at the start (m, m, rad).
    pub displacement: [f64; 3],
    /// Its covariance, 3×3, full row-major (m², m·rad, rad²).
    pub covariance: [f64; 9],
    /// At which it saw this robot at the stamp, in its body frame (rad).
    pub bearing: f64,
    /// Variance of all errors of that (rad²).
    pub bearing_variance: f64,
}

layout!(Increment, 168; header: 0, flags: 40, reserved: 41, start_ns: 48, displacement: 56, covariance: 80, bearing: 152, bearing_variance: 160);

impl Increment {
    /// In `flags`: there is a bearing.
    pub const BEARING: u8 = 1;

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.displacement)?;
        Limits::check_finite(&[self.bearing, self.bearing_variance])?;
        Matrix::<3>::from_row_major(self.covariance).check_covariance()?;
        if self.has_bearing() && self.bearing_variance <= 0.0 {
            return Err(Reject::NoCovariance);
        }
        Limits::check_supported(self.is_supported())?;
        limits.check_other(self.header.source)?;
        limits.check_time(&self.header)
    }

    /// Whether there is a bearing.
    #[must_use]
    pub const fn has_bearing(&self) -> bool {
        self.flags & Self::BEARING != 0
    }

    /// Whether there is a motion.
    #[must_use]
    pub const fn has_motion(&self) -> bool {
        self.start_ns < self.header.stamp_ns
    }

    fn is_supported(&self) -> bool {
        let stands = all_zero(&self.displacement) && all_zero(&self.covariance);
        let blind = all_zero(&[self.bearing, self.bearing_variance]);
        self.flags <= Self::BEARING
            && self.reserved == [0; 7]
            && self.start_ns <= self.header.stamp_ns
            && (self.has_motion() || stands)
            && (self.has_bearing() || blind)
    }
}
