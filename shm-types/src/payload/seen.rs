//! Where another robot has seen this one.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::{Matrix, all_zero};
use crate::{Limits, Reject};

/// `coloc/<robot>/seen`: where this robot must be, as another one knows it that has seen it in part, and the question where it
/// believes to be. Nothing is said of its heading.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Seen.v1")]
pub struct Seen {
    /// When the other robot saw this one, by which clock; `source` is the other robot's team number.
    pub header: Header,
    /// Which of the other robot's sensors saw it.
    pub sensor: u16,
    /// [`Self::NO_ANSWER`], [`Self::NOTHING_TOLD`].
    pub flags: u8,
    /// Zero, others are refused.
    pub reserved: [u8; 5],
    /// Which life of that sensor: `session` of its [`Sighting`](crate::Sighting).
    pub session: u64,
    /// Which of its sightings: its `sequence`.
    pub sighting: u64,
    /// `[x, y]` of the receiving robot in the common frame (m).
    pub position: [f64; 2],
    /// The part of its covariance that is independent of everything else, 2×2, full row-major (m²).
    pub independent: [f64; 4],
    /// The part that may depend on anything, likewise.
    pub dependent: [f64; 4],
}

layout!(Seen, 144; header: 0, sensor: 40, flags: 42, reserved: 43, session: 48, sighting: 56, position: 64, independent: 80, dependent: 112);

impl Seen {
    /// In `flags`: no answer is wanted.
    pub const NO_ANSWER: u8 = 1;
    /// In `flags`: who asks does not know where it is, or cannot tell it of what it saw. All numbers of the position are zero.
    pub const NOTHING_TOLD: u8 = 2;

    /// Checks everything that can be known of this message alone.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        if self.flags & Self::NOTHING_TOLD == 0 {
            check_place(&self.position, &self.independent, &self.dependent)?;
        } else {
            let numbers = [&self.position[..], &self.independent, &self.dependent];
            Limits::check_supported(numbers.into_iter().all(all_zero))?;
        }
        let is_known = self.flags <= Self::NOTHING_TOLD;
        Limits::check_supported(is_known && self.reserved == [0; 5])?;
        limits.check_other(self.header.source)?;
        limits.check_time(&self.header)
    }
}

/// That both parts are covariances and no variance of the whole is zero.
pub(super) fn check_place(
    position: &[f64; 2],
    independent: &[f64; 4],
    dependent: &[f64; 4],
) -> Result<(), Reject> {
    Limits::check_finite(position)?;
    let [independent, dependent] =
        [independent, dependent].map(|rows| Matrix::<2>::from_row_major(*rows));
    Matrix::check_parts(&independent, &dependent)?;
    independent.plus(&dependent).check_variances()
}
