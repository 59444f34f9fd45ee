//! Covariance matrices that have been checked once and are valid from then on.

use nalgebra::{Matrix2, Matrix3};

/// Why a matrix is not a covariance.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum NotACovariance {
    /// An entry is NaN or infinite.
    NotFinite,
    /// Two entries across the diagonal differ by more than rounding.
    Asymmetric,
    /// An eigenvalue is below zero by more than rounding.
    NotPositiveSemidefinite,
}

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
        let _ = matrix;
        unimplemented!()
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> &Matrix3<f64> {
        &self.0
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

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> &Matrix2<f64> {
        &self.0
    }
}
