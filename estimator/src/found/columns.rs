//! A covariance as a sum of squares of columns, so that what is learnt leaves one: `C = Σ d l lᵀ`.
//!
//! ```text
//! y = H l      S = Σ d y yᵀ + R      W = Σ d l yᵀ S⁻¹      C⁺ = Σ d (l − W y)(l − W y)ᵀ + W R Wᵀ
//! ```
//!
//! This is Joseph's form. Where a good fix leaves next to nothing of a large C, products of whole matrices leave rounding of C, which
//! may be more than what is left, of either sign; squares of what is left of columns have the right one.

use nalgebra::{Matrix2, SMatrix, SVector};

use crate::factor::pivot;

/// `L D Lᵀ`, columns of L and the diagonal of D, which is no less than zero.
#[derive(Copy, Clone, Debug)]
pub(super) struct Columns<const N: usize> {
    columns: SMatrix<f64, N, N>,
    weights: SVector<f64, N>,
}

/// What a measurement does.
#[derive(Copy, Clone, Debug)]
pub(super) struct Learnt<const N: usize> {
    pub(super) gain: SMatrix<f64, N, 2>,
    /// `C⁺`
    pub(super) covariance: SMatrix<f64, N, N>,
}

impl<const N: usize> Columns<N> {
    /// A pivot that is rounding of its diagonal entry is zero.
    pub(super) fn of(covariance: &SMatrix<f64, N, N>) -> Self {
        let mut rest = *covariance;
        let mut columns = SMatrix::<f64, N, N>::identity();
        let mut weights = SVector::<f64, N>::zeros();
        for at in 0..N {
            let (weight, reciprocal) = pivot(rest[(at, at)], covariance[(at, at)]);
            weights[at] = weight;
            for row in at + 1..N {
                columns[(row, at)] = rest[(row, at)] * reciprocal;
            }
            for column in at + 1..N {
                let by = weight * columns[(column, at)];
                for row in column..N {
                    rest[(row, column)] -= columns[(row, at)] * by;
                }
            }
        }
        Self { columns, weights }
    }

    /// After a measurement `H x` with `noise`; `None` if that is none, or more than there are numbers for.
    pub(super) fn learn(
        &self,
        observed: &SMatrix<f64, 2, N>,
        noise: &Matrix2<f64>,
    ) -> Option<Learnt<N>> {
        let seen = observed * self.columns;
        let (mut sum, mut crossed) = (*noise, SMatrix::<f64, N, 2>::zeros());
        for at in 0..N {
            let (weight, seen) = (self.weights[at], seen.column(at));
            sum += weight * seen * seen.transpose();
            crossed += self.columns.column(at) * (weight * seen).transpose();
        }
        let is_number = sum.iter().all(|it| it.is_finite());
        let gain = crossed * sum.try_inverse().filter(|_| is_number)?;
        let covariance = self.less(&gain, &seen) + brought(&gain, noise);
        Some(Learnt { gain, covariance })
    }

    /// `Σ d (l − W y)(l − W y)ᵀ`
    fn less(&self, gain: &SMatrix<f64, N, 2>, seen: &SMatrix<f64, 2, N>) -> SMatrix<f64, N, N> {
        let left = self.columns - gain * seen;
        let mut all = SMatrix::<f64, N, N>::zeros();
        for at in 0..N {
            for column in 0..N {
                let by = self.weights[at] * left[(column, at)];
                for row in column..N {
                    all[(row, column)] += left[(row, at)] * by;
                }
            }
        }
        mirrored(all)
    }
}

/// `W R Wᵀ`
fn brought<const N: usize>(gain: &SMatrix<f64, N, 2>, noise: &Matrix2<f64>) -> SMatrix<f64, N, N> {
    let factor = Columns::of(&SMatrix::<f64, 2, 2>::from(*noise));
    let columns = gain * factor.columns;
    let mut all = SMatrix::<f64, N, N>::zeros();
    for at in 0..2 {
        let column: SVector<f64, N> = columns.column(at).into_owned();
        all += factor.weights[at] * column * column.transpose();
    }
    mirrored(all)
}

/// What stands below the diagonal stands above it too.
fn mirrored<const N: usize>(mut lower: SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    lower.fill_upper_triangle_with_lower_triangle();
    lower
}
