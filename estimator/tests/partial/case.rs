//! What all cases have in common: the belief, and how close is close enough.

use coloc_estimator::angle::wrap;
use coloc_estimator::{Belief, Pose};

#[path = "../state/mod.rs"]
mod state;

use state::in_common_axes;
pub(crate) use state::{Rows, Rows2, State, covariance, covariance2};

/// How far from what is expected a belief may be, in its own deviations and beside them.
pub(crate) struct Tolerance {
    /// Of a coordinate of the pose, given its σ.
    pub(crate) pose: fn(sigma: f64) -> f64,
    /// Of the parts and the bend.
    pub(crate) relative: f64,
    /// Of the parts.
    pub(crate) beside: f64,
}

impl Tolerance {
    pub(crate) fn check(&self, name: &str, found: &Belief, expected: &State) {
        let total = |i: usize, j: usize| expected.P_i[i][j] + expected.P_d[i][j];
        let sigma: [f64; 3] = std::array::from_fn(|i| total(i, i).max(0.0).sqrt());
        let Pose { x, y, phi } = found.pose;
        let errors = [
            x - expected.x[0],
            y - expected.x[1],
            wrap(phi - expected.x[2]),
        ];
        for (i, error) in errors.into_iter().enumerate() {
            let allowed = (self.pose)(sigma[i]);
            assert!(
                error.abs() <= allowed,
                "{name}: x[{i}] off by {error:e}, {allowed:e} allowed"
            );
        }
        for (part, found, rows) in [
            ("P_i", &found.parts.independent, &expected.P_i),
            ("P_d", &found.parts.dependent, &expected.P_d),
        ] {
            for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                let error = (found.matrix()[(i, j)] - rows[i][j]).abs();
                let allowed = self.relative * sigma[i] * sigma[j] + self.beside;
                assert!(
                    error <= allowed,
                    "{name}: {part}[{i}][{j}] off by {error:e}, {allowed:e}"
                );
            }
        }
        let allowed = self.relative * (total(0, 0) + total(1, 1)).sqrt();
        let bends = in_common_axes(found).into_iter().zip(expected.K_H);
        for (a, b) in bends.flat_map(|(a, b)| a.into_iter().zip(b)) {
            let error = (a - b).abs();
            assert!(
                error <= allowed,
                "{name}: K_H {a:e} is not {b:e}: {error:e} > {allowed:e}"
            );
        }
    }
}
