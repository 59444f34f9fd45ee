//! What all cases have in common: moments, and the tolerances of the vectors' README.

use coloc_estimator::angle::wrap;
use coloc_estimator::{Belief, Covariance3, Parts, Pose};
use nalgebra::Matrix3;
use serde::Deserialize;

pub(crate) type Rows = [[f64; 3]; 3];

#[derive(Deserialize)]
pub(crate) struct File<I, E> {
    pub(crate) cases: Vec<Case<I, E>>,
}

#[derive(Deserialize)]
pub(crate) struct Case<I, E> {
    pub(crate) id: String,
    pub(crate) tag: String,
    #[serde(default)]
    pub(crate) tol: f64,
    pub(crate) input: I,
    pub(crate) expected: E,
}

#[derive(Deserialize)]
pub(crate) struct Moments {
    pub(crate) x: [f64; 3],
    pub(crate) P: Rows,
    pub(crate) P_ind: Rows,
}

impl Moments {
    pub(crate) fn belief(&self) -> Belief {
        let (total, independent) = (covariance(&self.P), covariance(&self.P_ind));
        Belief::gaussian(pose(self.x), Parts::of(&total, &independent))
    }
}

/// The tolerances of the vectors' README: poses to `pose` (relative to their size or σ), covariances to
/// `covariance` of the σ concerned plus `floor`.
pub(crate) struct Tolerance {
    pub(crate) pose: fn(value: f64, sigma: f64, relative: f64) -> f64,
    pub(crate) relative: f64,
    pub(crate) covariance: f64,
}

impl<I, E> Case<I, E> {
    pub(crate) fn name(&self) -> String {
        format!("{} ({})", self.id, self.tag)
    }
}

/// For propagation, conversion and fixes.
pub(crate) const CUBATURE: Tolerance = Tolerance {
    pose: |value, _, relative| relative * value.abs().max(1.0),
    relative: 1e-9,
    covariance: 1e-8,
};

/// For fusions, whose cost is flat around the best weight.
pub(crate) fn fusion_tolerance(tol: f64) -> Tolerance {
    Tolerance {
        pose: |_, sigma, relative| relative * sigma + 1e-12,
        relative: tol,
        covariance: tol,
    }
}

impl Tolerance {
    pub(crate) fn check(&self, name: &str, belief: &Belief, expected: &Moments) {
        let sigma = sigma(&expected.P);
        let found = belief.pose.to_vector();
        for i in 0..3 {
            let allowed = (self.pose)(expected.x[i], sigma[i], self.relative);
            let error = found[i] - expected.x[i];
            let error = if i == 2 { wrap(error) } else { error };
            assert!(
                error.abs() <= allowed,
                "{name}: pose[{i}] off by {error:e}, {allowed:e} allowed"
            );
        }
        self.check_covariance(&format!("{name}: P"), &belief.total(), &expected.P, sigma);
        self.check_covariance(
            &format!("{name}: P_i"),
            &belief.parts.independent,
            &expected.P_ind,
            sigma,
        );
    }

    pub(crate) fn check_covariance(
        &self,
        name: &str,
        found: &Covariance3,
        expected: &Rows,
        sigma: [f64; 3],
    ) {
        for (i, row) in expected.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let error = found.matrix()[(i, j)] - value;
                let allowed = self.covariance * sigma[i] * sigma[j] + 1e-18;
                assert!(
                    error.abs() <= allowed,
                    "{name}[{i}][{j}] off by {error:e}, {allowed:e} allowed"
                );
            }
        }
        assert!(
            Covariance3::new(found.matrix()).is_ok(),
            "{name} is no covariance"
        );
    }
}

pub(crate) fn sigma(total: &Rows) -> [f64; 3] {
    [total[0][0].sqrt(), total[1][1].sqrt(), total[2][2].sqrt()]
}

pub(crate) fn pose([x, y, phi]: [f64; 3]) -> Pose {
    Pose::new(x, y, phi)
}

pub(crate) fn covariance(rows: &Rows) -> Covariance3 {
    Covariance3::new(Matrix3::from_fn(|i, j| rows[i][j])).unwrap()
}

#[derive(Deserialize)]
pub(crate) struct Fused {
    #[serde(flatten)]
    pub(crate) moments: Moments,
    pub(crate) accepted: bool,
    pub(crate) alpha: Option<f64>,
    pub(crate) d2: f64,
}
