//! A robot's sighting of another.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::Matrix;
use crate::{Limits, Reject};

/// `coloc/<robot>/relative_pose`: this robot's sighting of another.
#[derive(Copy, Clone, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.RelativePose.v2")]
pub struct RelativePose {
    /// When it was seen, by which clock, and which sensor saw it.
    pub header: Header,
    /// Team number of the robot that was seen.
    pub observed: u16,
    /// Which coordinates were measured: bit 0 x, bit 1 y, bit 2 φ. Today [`Self::ALL`], others are refused; and [`Self::OF_TRACK`] of
    /// `coloc-track`, where the configuration says that it is heard.
    pub components: u8,
    /// Zero.
    pub reserved: [u8; 5],
    /// `[δx, δy, δφ]` of the observed robot in this robot's body frame (m, m, rad).
    pub pose: [f64; 3],
    /// R of `pose`, 3×3, full row-major (m², m·rad, rad²). It may be singular, but no variance may be zero.
    pub covariance: [f64; 9],
}

layout!(RelativePose, 144; header: 0, observed: 40, components: 42, reserved: 43, pose: 48, covariance: 72);

impl Default for RelativePose {
    /// Of all coordinates; everything else is zero.
    fn default() -> Self {
        Self {
            header: Header::default(),
            observed: 0,
            components: Self::ALL,
            reserved: [0; 5],
            pose: [0.0; 3],
            covariance: [0.0; 9],
        }
    }
}

impl RelativePose {
    /// `components` of a sighting that has x, y and the heading.
    pub const ALL: u8 = 0b111;

    /// `components` of a track's pose: all coordinates, and nothing of their error is independent of what either robot believes or
    /// has heard. Who does not know that refuses it.
    pub const OF_TRACK: u8 = Self::ALL | 0x80;

    /// `source` of tracks' poses: no sensor of the robot has it.
    pub const TRACK: u16 = u16::MAX;

    /// Checks everything that can be known of this message alone. The angle may be any finite number.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Matrix::<3>::from_row_major(self.covariance).check_covariance()?;
        self.validate_beside_covariance(limits)
    }

    /// All of [`Self::validate`], except whether R is a covariance: for who makes something of it that checks it.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate_beside_covariance(&self, limits: &Limits) -> Result<(), Reject> {
        self.check_beside_covariance(limits, Self::ALL)
    }

    /// [`Self::validate`], of who hears tracks: of a track's pose, and of nothing else.
    ///
    /// # Errors
    /// Likewise.
    pub fn validate_of_track(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Matrix::<3>::from_row_major(self.covariance).check_covariance()?;
        self.check_beside_covariance(limits, Self::OF_TRACK)
    }

    /// Whether it is a track's.
    #[must_use]
    pub const fn is_of_track(&self) -> bool {
        self.components == Self::OF_TRACK
    }

    fn check_beside_covariance(&self, limits: &Limits, components: u8) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Matrix::<3>::from_row_major(self.covariance).check_variances()?;
        Limits::check_supported(self.components == components)?;
        limits.check_other(self.observed)?;
        limits.check_time(&self.header)
    }
}
