//! Where a neighbour is, seen from here.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::{Matrix, all_zero};
use crate::{Limits, Reject};

/// `coloc/<robot>/tracked`: where a neighbour is in this robot's body frame, as `coloc-track` has it of what was seen of it in part.
///
/// For controllers, and for who has to know which robot is which. It is made of sightings that `colocd` uses as well: whoever takes it
/// as a measurement of its own counts them twice. What may feed `colocd` goes another way, [`RelativePose::OF_TRACK`](super::RelativePose).
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Tracked.v1")]
pub struct Tracked {
    /// The moment that it is of, by which clock; `source` is the team number of the robot that tracks.
    pub header: Header,
    /// Team number of the neighbour.
    pub observed: u16,
    /// [`Self::POSITION`], and [`Self::HEADING`] where that is known.
    pub has: u8,
    /// [`Self::CONFIRMED`] or [`Self::COASTED`].
    pub status: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 4],
    /// When it was last seen (ns of the header's clock).
    pub seen_ns: i64,
    /// `[x, y, φ]` in this robot's body frame; φ is zero where it is not known (m, m, rad).
    pub pose: [f64; 3],
    /// Its covariance, 3×3, full row-major; zero in the row and the column of a heading that is not known (m², m·rad, rad²).
    pub covariance: [f64; 9],
}

layout!(Tracked, 152; header: 0, observed: 40, has: 42, status: 43, reserved: 44, seen_ns: 48, pose: 56, covariance: 80);

impl Tracked {
    /// In `has`: there is a position. There always is.
    pub const POSITION: u8 = 1;
    /// In `has`: there is a heading.
    pub const HEADING: u8 = 2;

    /// `status` of a neighbour that was seen of late.
    pub const CONFIRMED: u8 = 1;
    /// `status` of one that was not.
    pub const COASTED: u8 = 2;

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        let covariance = Matrix::<3>::from_row_major(self.covariance);
        covariance.check_covariance()?;
        let [xx, _, _, _, yy, _, _, _, turn] = self.covariance;
        let is_exact = xx <= 0.0 || yy <= 0.0 || (self.has_heading() && turn <= 0.0);
        if is_exact {
            return Err(Reject::NoCovariance);
        }
        Limits::check_supported(self.is_supported())?;
        limits.check_member(self.header.source)?;
        limits.check_other(self.observed)?;
        limits.check_time(&self.header)
    }

    /// Whether the heading is known.
    #[must_use]
    pub const fn has_heading(&self) -> bool {
        self.has & Self::HEADING != 0
    }

    fn is_supported(&self) -> bool {
        let [_, _, a, _, _, b, c, d, turn] = self.covariance;
        let unturned = all_zero(&[self.pose[2], a, b, c, d, turn]);
        let has = [Self::POSITION, Self::POSITION | Self::HEADING].contains(&self.has);
        let status = [Self::CONFIRMED, Self::COASTED].contains(&self.status);
        has && status && self.reserved == [0; 4] && (self.has_heading() || unturned)
    }
}
