//! One robot's errors and uncertainties in one run.

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use nalgebra::{Matrix3, Vector3};

/// An estimate held against the truth.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sample {
    /// x̂ − x \[m, m, rad\], heading wrapped.
    pub error: [f64; 3],
    /// Diagonal of P \[m², m², rad²\].
    pub variance: [f64; 3],
    /// eᵀ P⁻¹ e; infinite if P is singular.
    pub nees: f64,
}

impl Sample {
    /// Holds `estimate` with covariance `p` against `truth`.
    #[must_use]
    pub fn new(estimate: &Pose, p: &Matrix3<f64>, truth: &Pose) -> Self {
        let error = [
            estimate.x - truth.x,
            estimate.y - truth.y,
            wrap(estimate.phi - truth.phi),
        ];
        Self {
            error,
            variance: [p.m11, p.m22, p.m33],
            nees: nees(&Vector3::from(error), p),
        }
    }
}

fn nees(error: &Vector3<f64>, p: &Matrix3<f64>) -> f64 {
    p.cholesky()
        .map_or(f64::INFINITY, |root| error.dot(&root.solve(error)))
}

/// All samples of a run, one per step; `None` where the truth is not known.
pub type Samples = Vec<Option<Sample>>;

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn errors_of_headings_are_wrapped() {
        let truth = Pose::new(1.0, 2.0, PI - 0.05);
        let sample = Sample::new(
            &Pose::new(1.5, 2.0, -PI + 0.05),
            &Matrix3::from_diagonal_element(0.01),
            &truth,
        );
        assert!((sample.error[0] - 0.5).abs() < 1e-12 && (sample.error[2] - 0.1).abs() < 1e-12);
        assert!(
            (sample.nees - 26.0).abs() < 1e-9,
            "0.25/0.01 + 0.01/0.01, found {}",
            sample.nees
        );
    }

    #[test]
    fn a_singular_covariance_is_infinitely_sure() {
        let sample = Sample::new(
            &Pose::default(),
            &Matrix3::zeros(),
            &Pose::new(0.1, 0.0, 0.0),
        );
        assert!(sample.nees.is_infinite());
    }
}
