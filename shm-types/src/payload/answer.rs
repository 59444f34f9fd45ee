//! Where a robot believed to be that this one has seen.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use super::seen::check_place;
use crate::layout::layout;
use crate::{Limits, Reject};

/// `coloc/<robot>/answer`: where a robot believed to be, before anything of that moment, when this one saw it in part. It answers
/// [`Seen`](crate::Seen).
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Answer.v1")]
pub struct Answer {
    /// The stamp of what is answered; `source` is the team number of the robot that was seen.
    pub header: Header,
    /// Which of the receiving robot's sensors saw it.
    pub sensor: u16,
    /// Zero, others are refused.
    pub reserved: [u8; 6],
    /// `session` of what is answered.
    pub session: u64,
    /// `sighting` of what is answered.
    pub sighting: u64,
    /// `[x, y]` of the sending robot in the common frame (m).
    pub position: [f64; 2],
    /// The part of its covariance that is independent of everything else, 2×2, full row-major (m²).
    pub independent: [f64; 4],
    /// The part that may depend on anything, likewise.
    pub dependent: [f64; 4],
}

layout!(Answer, 144; header: 0, sensor: 40, reserved: 42, session: 48, sighting: 56, position: 64, independent: 80, dependent: 112);

impl Answer {
    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        check_place(&self.position, &self.independent, &self.dependent)?;
        Limits::check_supported(self.reserved == [0; 6])?;
        limits.check_other(self.header.source)?;
        limits.check_time(&self.header)
    }
}
