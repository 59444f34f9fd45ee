//! A yaw rate.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::{Limits, Reject};

/// `coloc/<robot>/gyro`: how fast this robot turns, as a gyro measures it, with the gyro's bias in it.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Gyro.v1")]
pub struct Gyro {
    /// When it was measured, by which clock, and which gyro. The rate is that of the time since the message before.
    pub header: Header,
    /// Counter-clockwise, seen from above (rad/s).
    pub rate_radps: f64,
    /// Density of its white noise (rad²/s); zero: as `[gyro]` in the robot's configuration has it.
    pub noise: f64,
    /// Zero, others are refused.
    pub reserved: [u8; 8],
}

layout!(Gyro, 64; header: 0, rate_radps: 40, noise: 48, reserved: 56);

impl Gyro {
    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&[self.rate_radps, self.noise])?;
        if self.noise < 0.0 {
            return Err(Reject::NoCovariance);
        }
        Limits::check_supported(self.reserved == [0; 8])?;
        limits.check_time(&self.header)
    }
}
