//! Odometry that does not come over CAN.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::{Matrix, all_zero};
use crate::{Limits, Reject};

/// `coloc/<robot>/odometry`: how the robot moves, from a driver of its base. A message stands for one interval of time.
/// `colocd` hears it where its configuration has `[odometry.base]`.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Odometry.v2")]
pub struct Odometry {
    /// Where the interval ends, by which clock, and which base measured it.
    pub header: Header,
    /// Where the interval of a [`OdometryKind::Twist`] begins (ns of the header's clock); 0: where the previous message of
    /// this session ended, as it always is with wheels.
    pub start_ns: i64,
    /// [`OdometryKind`] of `values`.
    pub kind: u8,
    /// Zero.
    pub reserved: [u8; 7],
    /// By `kind`; what a kind does not use is zero.
    pub values: [f64; 4],
    /// Covariance of `[v_x, v_y, ω]` over the interval, 3×3, full row-major (m²/s², m·rad/s², rad²/s²). All zero: as
    /// configured in `[motion]`.
    pub covariance: [f64; 9],
}

layout!(Odometry, 160; header: 0, start_ns: 40, kind: 48, reserved: 49, values: 56, covariance: 88);

/// What the values of an [`Odometry`] are.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum OdometryKind {
    /// `[v_x, v_y, ω]`: mean velocity over the interval in the body frame (m/s, m/s, rad/s).
    Twist = 0,
    /// `[left, right]`: how far each wheel has come since the session began (m).
    WheelDistances = 1,
    /// `[left, right]`: counts of each wheel's encoder since the session began, whole numbers.
    WheelCounts = 2,
}

impl OdometryKind {
    /// The byte of a payload, decoded.
    ///
    /// # Errors
    /// [`Reject::Unsupported`] if it has no meaning.
    pub const fn from_byte(byte: u8) -> Result<Self, Reject> {
        match byte {
            0 => Ok(Self::Twist),
            1 => Ok(Self::WheelDistances),
            2 => Ok(Self::WheelCounts),
            _ => Err(Reject::Unsupported),
        }
    }

    /// How many of the values it uses.
    const fn used(self) -> usize {
        match self {
            Self::Twist => 3,
            Self::WheelDistances | Self::WheelCounts => 2,
        }
    }
}

impl Odometry {
    /// What the values are.
    ///
    /// # Errors
    /// [`Reject::Unsupported`] if the byte has no meaning.
    pub const fn kind(&self) -> Result<OdometryKind, Reject> {
        OdometryKind::from_byte(self.kind)
    }

    /// Whether its noise is as configured, and not as it says.
    #[must_use]
    pub fn has_configured_noise(&self) -> bool {
        all_zero(&self.covariance)
    }

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.values)?;
        Matrix::<3>::from_row_major(self.covariance).check_covariance()?;
        self.check_variances()?;
        Limits::check_supported(self.uses_what_its_kind_has())?;
        limits.check_clock(&self.header)?;
        if self.start_ns != 0 && self.start_ns >= self.header.stamp_ns {
            return Err(Reject::EmptyInterval);
        }
        limits.check_time(&self.header)
    }

    /// A robot that cannot move sideways is sure of that; of nothing else.
    fn check_variances(&self) -> Result<(), Reject> {
        let [vx, .., omega] = self.covariance;
        let known = self.has_configured_noise() || (vx > 0.0 && omega > 0.0);
        known.then_some(()).ok_or(Reject::NoCovariance)
    }

    /// Whether the kind is known, what it has no use for is zero, and counts are counts.
    fn uses_what_its_kind_has(&self) -> bool {
        self.kind().is_ok_and(|kind| {
            let unused = self.values.get(kind.used()..);
            let counts = kind != OdometryKind::WheelCounts
                || self.values.iter().all(|value| is_count(*value));
            let begins = kind == OdometryKind::Twist || self.start_ns == 0;
            unused.is_some_and(all_zero) && counts && begins
        })
    }
}

/// A whole number that a double holds exactly, with its neighbours.
fn is_count(value: f64) -> bool {
    value.fract() == 0.0 && value.abs() < 9_007_199_254_740_992.0
}
