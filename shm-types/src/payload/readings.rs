//! What a robot has seen of children, for leaders.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::{Matrix, all_zero};
use crate::{Limits, Reject};

/// `coloc/<robot>/readings`: all that another robot saw of children in one event, once it is over; for this robot, a leader, which tells
/// children by it where they are.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Readings.v1")]
pub struct Readings {
    /// The middle of the event; `source` is the sender's team number.
    pub header: Header,
    /// Which event: `⌊(stamp − phase)/period⌋`, by `[assist]`.
    pub slot: i64,
    /// Of the leader's covariance, `x` and `y` and `φ` (m² and rad²); zero without [`Self::LEADS`].
    pub trace: f64,
    /// Where the sender was after each eighth of the event by its own wheels, seen from where it was at the beginning (m, m, rad); zero
    /// without [`Self::WAY`].
    pub way: [[f64; 3]; 8],
    /// Of the last of them, 3×3, full row-major (m², m·rad, rad²).
    pub way_covariance: [f64; 9],
    /// What it saw.
    pub sights: [Sight; 16],
    /// So many; the others are zero.
    pub count: u8,
    /// [`Self::LEADS`], [`Self::WAY`].
    pub flags: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 6],
}

/// A child that is seen.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Sight.v1")]
pub struct Sight {
    /// So long after the event's beginning (ns).
    pub since_ns: i64,
    /// `[x, y, φ]` of the child in the sender's frame at that time (m, m, rad).
    pub pose: [f64; 3],
    /// Its covariance, 3×3, full row-major (m², m·rad, rad²).
    pub covariance: [f64; 9],
    /// Team number of the child.
    pub observed: u16,
    /// Zero, others are refused.
    pub reserved: [u8; 6],
}

layout!(Sight, 112; since_ns: 0, pose: 8, covariance: 32, observed: 104, reserved: 106);
layout!(Readings, 2120;
    header: 0, slot: 40, trace: 48, way: 56, way_covariance: 248, sights: 320, count: 2112, flags: 2113, reserved: 2114,
);

impl Readings {
    /// In `flags`: the sender leads, and knows where it is.
    pub const LEADS: u8 = 1;
    /// In `flags`: the sender knows how it moved.
    pub const WAY: u8 = 2;

    /// What was seen.
    #[must_use]
    pub fn sights(&self) -> &[Sight] {
        self.sights
            .get(..usize::from(self.count))
            .unwrap_or(&self.sights)
    }

    /// Checks everything that can be known of this message alone. The angles may be any finite numbers.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&[self.trace])?;
        Limits::check_finite(self.way.as_flattened())?;
        for sight in self.sights() {
            Limits::check_finite(&sight.pose)?;
        }
        Matrix::<3>::from_row_major(self.way_covariance).check_covariance()?;
        for sight in self.sights() {
            let covariance = Matrix::<3>::from_row_major(sight.covariance);
            covariance.check_covariance()?;
            covariance.check_variances()?;
        }
        Limits::check_supported(self.uses_what_is_known())?;
        limits.check_other(self.header.source)?;
        for sight in self.sights() {
            limits.check_member(sight.observed)?;
        }
        limits.check_time(&self.header)
    }

    fn uses_what_is_known(&self) -> bool {
        let has = |flag| self.flags & flag != 0;
        let unsaid = self.sights.get(usize::from(self.count)..);
        let way = all_zero(self.way.as_flattened()) && all_zero(&self.way_covariance);
        unsaid.is_some_and(|it| it.iter().all(|sight| *sight == Sight::default()))
            && self.flags <= Self::LEADS | Self::WAY
            && (has(Self::LEADS) || self.trace == 0.0)
            && (has(Self::WAY) || way)
            && self.reserved == [0; 6]
            && self.sights().iter().all(|it| it.reserved == [0; 6])
    }
}
