//! A satellite fix.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::Matrix;
use crate::{Limits, Reject};

/// `coloc/<robot>/position`: a satellite fix in the local frame.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Position.v1")]
pub struct Position {
    /// Stamp, session and sequence of the receiver's driver.
    pub header: Header,
    /// Quality field of NMEA GGA: 0 no fix, 1 autonomous, 2 differential, 4 RTK fixed, 5 RTK float; at most 8.
    pub quality: u8,
    /// Zero.
    pub reserved: [u8; 7],
    /// `[x, y]` in the common frame (m).
    pub position: [f64; 2],
    /// R of `position`, 2×2, full row-major (m²).
    pub covariance: [f64; 4],
}

layout!(Position, 80; header: 0, quality: 24, reserved: 25, position: 32, covariance: 48);

impl Position {
    /// Qualities of a fix that was measured: not estimated (6), typed in (7) or simulated (8).
    const MEASURED: core::ops::RangeInclusive<u8> = 1..=5;

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.position)?;
        Matrix::<2>::from_row_major(self.covariance).check_covariance()?;
        limits.check_time(&self.header)?;
        if Self::MEASURED.contains(&self.quality) {
            Ok(())
        } else {
            Err(Reject::BadQuality)
        }
    }
}
