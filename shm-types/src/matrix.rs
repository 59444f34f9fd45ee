//! Whether a matrix from outside is a covariance.
//!
//! Every tolerance is relative to the standard deviations of the two coordinates concerned: 1 mm² next to 1 rad², or
//! variances of 1e-12 and of 1e+6, are judged alike.
use crate::Reject;

/// What still counts as rounding. Wide enough for decimal text, narrow enough to catch a wrong sign.
const ROUNDING: f64 = 1e-9;

/// Entries beyond this count as infinite: products of three of them would be.
const LARGEST: f64 = 1e60;

/// An N×N matrix, row by row.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Matrix<const N: usize>([[f64; N]; N]);

impl Matrix<2> {
    pub(crate) fn from_row_major([a, b, c, d]: [f64; 4]) -> Self {
        Self([[a, b], [c, d]])
    }
}

impl Matrix<3> {
    pub(crate) fn from_row_major([a, b, c, d, e, f, g, h, i]: [f64; 9]) -> Self {
        Self([[a, b, c], [d, e, f], [g, h, i]])
    }
}

impl<const N: usize> Matrix<N> {
    /// Finite, symmetric, positive semidefinite; the first that fails is the reason.
    pub(crate) fn check_covariance(&self) -> Result<(), Reject> {
        match () {
            () if !all_finite(self.0.as_flattened()) => Err(Reject::NotFinite),
            () if !self.is_symmetric(&self.variances()) => Err(Reject::Asymmetric),
            () if !self.is_semidefinite(&self.variances()) => Err(Reject::NotPositiveSemidefinite),
            () => Ok(()),
        }
    }

    /// No variance is zero. A sensor cannot know a coordinate so well: who says so knows nothing of its noise.
    pub(crate) fn check_variances(&self) -> Result<(), Reject> {
        let known = self.variances().iter().all(|variance| *variance > 0.0);
        known.then_some(()).ok_or(Reject::NoCovariance)
    }

    /// Both parts are covariances, the dependent one to what is left of the precision of the whole: it may be a difference.
    pub(crate) fn check_parts(independent: &Self, dependent: &Self) -> Result<(), Reject> {
        let whole = independent.plus(dependent);
        let dependent = dependent.check_beside(&whole.variances());
        earliest(independent.check_covariance(), dependent)
    }

    /// Finite, symmetric, positive semidefinite by the measure of `variances`.
    fn check_beside(&self, variances: &[f64; N]) -> Result<(), Reject> {
        match () {
            () if !all_finite(self.0.as_flattened()) => Err(Reject::NotFinite),
            () if !self.is_symmetric(variances) => Err(Reject::Asymmetric),
            () if self.is_semidefinite(variances) => Ok(()),
            () => Err(Reject::DependentNotPositiveSemidefinite),
        }
    }

    /// Both are covariances, and so is their difference.
    pub(crate) fn check_split(total: &Self, independent: &Self) -> Result<(), Reject> {
        earliest(total.check_covariance(), independent.check_covariance())?;
        if total.minus(independent).is_semidefinite(&total.variances()) {
            Ok(())
        } else {
            Err(Reject::DependentNotPositiveSemidefinite)
        }
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self(core::array::from_fn(|i| {
            core::array::from_fn(|j| self.0[i][j] + other.0[i][j])
        }))
    }

    fn minus(&self, other: &Self) -> Self {
        Self(core::array::from_fn(|i| {
            core::array::from_fn(|j| self.0[i][j] - other.0[i][j])
        }))
    }

    fn variances(&self) -> [f64; N] {
        core::array::from_fn(|i| self.0[i][i])
    }

    fn is_symmetric(&self, variances: &[f64; N]) -> bool {
        // A negative variance is not an asymmetry: the next check has its own name for it.
        let has_negative = variances.iter().any(|variance| *variance < 0.0);
        pairs::<N>().all(|(i, j)| {
            let difference = self.0[i][j] - self.0[j][i];
            let allowed = ROUNDING * ROUNDING * variances[i] * variances[j];
            difference == 0.0 || difference * difference <= allowed || has_negative
        })
    }

    /// Whether no eigenvalue, in units of the deviations that `variances` are the squares of, is below zero by more than
    /// rounding.
    ///
    /// That is whether the Cholesky factorization of A + ε diag(`variances`) goes through: scaling changes no pivot's sign.
    /// A coordinate without variance must not vary beyond what a number can hold, and takes no part.
    fn is_semidefinite(&self, variances: &[f64; N]) -> bool {
        self.is_zero_where_certain(variances) && self.rounded_up(variances).is_definite()
    }

    fn is_zero_where_certain(&self, variances: &[f64; N]) -> bool {
        let deviations = variances.map(largest_deviation);
        let varies = |i: usize, j: usize| self.0[i][j].abs() > deviations[i] * deviations[j];
        (0..N)
            .filter(|i| variances[*i] == 0.0)
            .all(|i| (0..N).all(|j| !varies(i, j) && !varies(j, i)))
    }

    fn rounded_up(&self, variances: &[f64; N]) -> Self {
        Self(core::array::from_fn(|i| {
            core::array::from_fn(|j| match (i == j, variances[i] == 0.0) {
                (true, true) => 1.0,
                (true, false) => self.0[i][i] + ROUNDING * variances[i],
                (false, _) => f64::midpoint(self.0[i][j], self.0[j][i]),
            })
        }))
    }

    /// Whether every pivot of the factorization is positive.
    fn is_definite(mut self) -> bool {
        (0..N).all(|k| {
            let pivot = self.0[k][k];
            for i in k + 1..N {
                let factor = self.0[i][k] / pivot;
                for j in k + 1..N {
                    self.0[i][j] -= factor * self.0[k][j];
                }
            }
            pivot > 0.0
        })
    }
}

/// A variance that is zero may have been too small for a number: its deviation, and a covariance with it, need not be.
fn largest_deviation(variance: f64) -> f64 {
    variance.max(ROUNDING * f64::MIN_POSITIVE).sqrt()
}

/// The earliest reason of the two, whichever has it.
fn earliest(one: Result<(), Reject>, other: Result<(), Reject>) -> Result<(), Reject> {
    match (one, other) {
        (Err(one), Err(other)) => Err(one.min(other)),
        (one, other) => one.and(other),
    }
}

/// Whether no number is NaN, infinite, or so large that it soon would be.
#[must_use]
pub fn all_finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.abs() <= LARGEST)
}

/// Whether every number is zero.
pub(crate) fn all_zero(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| *number == 0.0)
}

fn pairs<const N: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..N).flat_map(|i| (i + 1..N).map(move |j| (i, j)))
}
