//! A satellite fix.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::Matrix;
use crate::{Limits, Reject};

/// `coloc/<robot>/position`: a satellite fix in the local frame.
#[derive(Copy, Clone, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Position.v2")]
pub struct Position {
    /// When the position was valid, by which clock, and which receiver measured it.
    pub header: Header,
    /// Quality field of NMEA GGA: 0 no fix, 1 autonomous, 2 differential, 4 RTK fixed, 5 RTK float; at most 8.
    pub quality: u8,
    /// Which coordinates were measured: bit 0 x, bit 1 y. Today [`Self::BOTH`], others are refused.
    pub components: u8,
    /// Zero.
    pub reserved: [u8; 6],
    /// `[x, y]` in the common frame (m).
    pub position: [f64; 2],
    /// R of `position`, 2×2, full row-major (m²): the error that is another one in every fix. It may be singular, but no
    /// variance may be zero: many receivers' drivers send zeros where they do not know it.
    pub covariance: [f64; 4],
    /// Standard deviation of the slow error in each coordinate (m): atmosphere, orbits, reflections, which the next fix will
    /// have again. 0 if unknown.
    pub slow_sigma_m: f64,
    /// Correlation time of the slow error (s). 0 if unknown.
    pub slow_time_s: f64,
    /// Where the antenna is in the robot's body frame, `[forward, left]` (m). Zero: as `colocd` has it in its configuration.
    /// Beyond [`Self::FARTHEST_M`] it is refused.
    pub lever_m: [f64; 2],
}

layout!(Position, 128;
    header: 0, quality: 40, components: 41, reserved: 42, position: 48, covariance: 64, slow_sigma_m: 96,
    slow_time_s: 104, lever_m: 112,
);

impl Default for Position {
    /// Of both coordinates; everything else is zero.
    fn default() -> Self {
        Self {
            header: Header::default(),
            quality: 0,
            components: Self::BOTH,
            reserved: [0; 6],
            position: [0.0; 2],
            covariance: [0.0; 4],
            slow_sigma_m: 0.0,
            slow_time_s: 0.0,
            lever_m: [0.0; 2],
        }
    }
}

impl Position {
    /// `components` of a fix that has x and y.
    pub const BOTH: u8 = 0b11;

    /// A lever longer than this is refused (m).
    pub const FARTHEST_M: f64 = 1000.0;

    /// Qualities of a fix that was measured: not estimated (6), typed in (7) or simulated (8).
    const MEASURED: core::ops::RangeInclusive<u8> = 1..=5;

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        self.check_finite()?;
        Matrix::<2>::from_row_major(self.covariance).check_covariance()?;
        self.validate_beside_covariance(limits)
    }

    /// All of [`Self::validate`], except whether R is a covariance: for who makes something of it that checks it.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate_beside_covariance(&self, limits: &Limits) -> Result<(), Reject> {
        self.check_finite()?;
        Limits::check_not_negative(&[self.slow_sigma_m, self.slow_time_s])?;
        Matrix::<2>::from_row_major(self.covariance).check_variances()?;
        Limits::check_supported(self.components == Self::BOTH && self.has_its_antenna_near())?;
        limits.check_time(&self.header)?;
        if Self::MEASURED.contains(&self.quality) {
            Ok(())
        } else {
            Err(Reject::BadQuality)
        }
    }

    fn has_its_antenna_near(&self) -> bool {
        let mut distances = self.lever_m.iter().map(|it| it.abs());
        distances.all(|it| it <= Self::FARTHEST_M)
    }

    fn check_finite(&self) -> Result<(), Reject> {
        Limits::check_finite(&self.position)?;
        Limits::check_finite(&self.lever_m)?;
        Limits::check_finite(&[self.slow_sigma_m, self.slow_time_s])
    }
}
