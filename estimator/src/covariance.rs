//! Covariance matrices that have been checked once and are valid from then on.

use core::fmt;

use nalgebra::{Matrix2, Matrix3};

/// Why a matrix is not a covariance.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum NotACovariance {
    /// An entry is NaN or infinite, or so large that computing with it would overflow.
    NotFinite,
    /// Two entries across the diagonal differ by more than rounding.
    Asymmetric,
    /// An eigenvalue is below zero by more than rounding.
    NotPositiveSemidefinite,
}

impl fmt::Display for NotACovariance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "an entry of the covariance is not a finite number",
            Self::Asymmetric => "the covariance is not symmetric",
            Self::NotPositiveSemidefinite => "the covariance has a negative eigenvalue",
        })
    }
}

impl core::error::Error for NotACovariance {}

/// What still counts as rounding, relative to the standard deviations of the two coordinates concerned.
///
/// Wide enough for decimal text and for what 32-bit senders round, narrow enough to catch a wrong sign.
const ROUNDING: f64 = 1e-9;

/// Variances beyond this are refused, so that determinants of 3×3 matrices stay finite.
const LARGEST: f64 = 1e60;

/// A symmetric positive semidefinite 3×3 matrix over `[x, y, φ]` (or `[v_x, v_y, ω]`).
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Covariance3(Matrix3<f64>);

/// A symmetric positive semidefinite 2×2 matrix over `[x, y]` (or `[v, ω]`).
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Covariance2(Matrix2<f64>);

impl Covariance3 {
    /// No uncertainty at all.
    pub const ZERO: Self = Self(Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0));

    /// Checks `matrix`; what is stored is exactly symmetric.
    ///
    /// # Errors
    /// What is wrong with the matrix, in the order of [`NotACovariance`].
    pub fn new(matrix: Matrix3<f64>) -> Result<Self, NotACovariance> {
        let _ = (matrix, ROUNDING, LARGEST);
        unimplemented!()
    }

    /// [`Self::new`] of the nine entries, row by row.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn from_row_major(entries: [f64; 9]) -> Result<Self, NotACovariance> {
        Self::new(Matrix3::from_row_slice(&entries))
    }

    /// Uncorrelated coordinates with these variances.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn diagonal(variances: [f64; 3]) -> Result<Self, NotACovariance> {
        Self::new(Matrix3::from_diagonal(&variances.into()))
    }

    /// Uncorrelated coordinates; a variance that is not a positive finite number counts as zero.
    pub(crate) fn clamped_diagonal(variances: [f64; 3]) -> Self {
        Self(Matrix3::from_diagonal(&variances.map(clamped).into()))
    }

    /// `factor · Σ`; a factor that is not a positive finite number counts as zero.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self(self.0 * clamped(factor))
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> &Matrix3<f64> {
        &self.0
    }

    /// The nine entries, row by row.
    #[must_use]
    pub fn to_row_major(&self) -> [f64; 9] {
        let m = &self.0;
        [
            m.m11, m.m12, m.m13, m.m21, m.m22, m.m23, m.m31, m.m32, m.m33,
        ]
    }
}

impl Covariance2 {
    /// No uncertainty at all.
    pub const ZERO: Self = Self(Matrix2::new(0.0, 0.0, 0.0, 0.0));

    /// Checks `matrix`; what is stored is exactly symmetric.
    ///
    /// # Errors
    /// What is wrong with the matrix, in the order of [`NotACovariance`].
    pub fn new(matrix: Matrix2<f64>) -> Result<Self, NotACovariance> {
        let _ = matrix;
        unimplemented!()
    }

    /// [`Self::new`] of the four entries, row by row.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn from_row_major(entries: [f64; 4]) -> Result<Self, NotACovariance> {
        Self::new(Matrix2::from_row_slice(&entries))
    }

    /// Uncorrelated coordinates with these variances.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn diagonal(variances: [f64; 2]) -> Result<Self, NotACovariance> {
        Self::new(Matrix2::from_diagonal(&variances.into()))
    }

    /// Uncorrelated coordinates; a variance that is not a positive finite number counts as zero.
    pub(crate) fn clamped_diagonal(variances: [f64; 2]) -> Self {
        Self(Matrix2::from_diagonal(&variances.map(clamped).into()))
    }

    /// `factor · Σ`; a factor that is not a positive finite number counts as zero.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self(self.0 * clamped(factor))
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> &Matrix2<f64> {
        &self.0
    }

    /// The four entries, row by row.
    #[must_use]
    pub fn to_row_major(&self) -> [f64; 4] {
        let m = &self.0;
        [m.m11, m.m12, m.m21, m.m22]
    }
}

fn clamped(a: f64) -> f64 {
    if a > 0.0 && a.is_finite() { a } else { 0.0 }
}
