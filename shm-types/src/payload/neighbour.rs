//! A robot's pose as a neighbour sees it.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::Matrix;
use crate::{Limits, Reject};

/// `coloc/<robot>/neighbour`: pose of this robot as a neighbour sees it.
///
/// Its covariance comes in two parts, so that none of them can lose its sign on the way; the whole is their sum.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Neighbour.v2")]
pub struct Neighbour {
    /// When the neighbour saw this robot, by which clock; `source` is the neighbour's team number.
    pub header: Header,
    /// `[x, y, φ]` of the receiving robot in the common frame (m, m, rad).
    pub pose: [f64; 3],
    /// `R*_i`, the part that is independent of everything else, 3×3, full row-major (m², m·rad, rad²).
    pub independent: [f64; 9],
    /// `R*_d`, the part that may depend on anything, likewise.
    pub dependent: [f64; 9],
}

layout!(Neighbour, 208; header: 0, pose: 40, independent: 64, dependent: 136);

impl Neighbour {
    /// Checks everything that can be known of this message alone. The angle may be any finite number.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        let [independent, dependent] = self.parts();
        Matrix::check_parts(&independent, &dependent)?;
        self.validate_beside_covariances(limits)
    }

    /// All of [`Self::validate`], except whether both parts are covariances: for who makes something of them that checks it.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate_beside_covariances(&self, limits: &Limits) -> Result<(), Reject> {
        let [independent, dependent] = self.parts();
        Limits::check_finite(&self.pose)?;
        independent.plus(&dependent).check_variances()?;
        limits.check_other(self.header.source)?;
        limits.check_time(&self.header)
    }

    fn parts(&self) -> [Matrix<3>; 2] {
        [self.independent, self.dependent].map(Matrix::<3>::from_row_major)
    }
}
