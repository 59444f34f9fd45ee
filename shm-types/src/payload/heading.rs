//! A heading: a compass', two antennas' or that of the course over ground.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::{Limits, Reject};

/// `coloc/<robot>/heading`: which way this robot looks, in the common frame.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Heading.v1")]
pub struct Heading {
    /// When it was right, by which clock, and which sensor measured it.
    pub header: Header,
    /// What it is the heading of: [`Self::COMPASS`], [`Self::ANTENNAS`] or [`Self::COURSE`]. Others are refused.
    pub what: u8,
    /// 0: the sensor says that it has none, and it is refused. 1 of a compass that is calibrated; of antennas and a course the
    /// quality of their fix, as in [`Position`](super::Position).
    pub quality: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 6],
    /// From the x axis to the left, any finite number (rad). A compass says it from north to the right: π/2 minus that, where the common
    /// frame has x east and y north.
    pub heading: f64,
    /// Variance of the error that is another one in every word (rad²). It may not be zero.
    pub variance: f64,
    /// Standard deviation of the slow error (rad): iron and currents near a compass, reflections, which the next word will have
    /// again. 0 if unknown.
    pub slow_sigma_rad: f64,
    /// Correlation time of the slow error (s). 0 if unknown.
    pub slow_time_s: f64,
}

layout!(Heading, 80;
    header: 0, what: 40, quality: 41, reserved: 42, heading: 48, variance: 56, slow_sigma_rad: 64, slow_time_s: 72,
);

impl Heading {
    /// `what` of a compass: where the body looks.
    pub const COMPASS: u8 = 0;
    /// `what` of two antennas: where the body looks.
    pub const ANTENNAS: u8 = 1;
    /// `what` of the course over ground: where an antenna moves. It counts only while the wheels say that it does.
    pub const COURSE: u8 = 2;

    /// As in [`Position`](super::Position): measured, not estimated, typed in or simulated.
    const MEASURED: core::ops::RangeInclusive<u8> = 1..=5;

    /// Checks everything that can be known of this message alone. The angle may be any finite number.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&[self.heading, self.variance])?;
        Limits::check_finite(&[self.slow_sigma_rad, self.slow_time_s])?;
        Limits::check_not_negative(&[self.variance, self.slow_sigma_rad, self.slow_time_s])?;
        if self.variance == 0.0 {
            return Err(Reject::NoCovariance);
        }
        Limits::check_supported(self.what <= Self::COURSE && self.reserved == [0; 6])?;
        limits.check_time(&self.header)?;
        if Self::MEASURED.contains(&self.quality) {
            Ok(())
        } else {
            Err(Reject::BadQuality)
        }
    }
}
