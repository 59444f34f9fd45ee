//! What all cases have in common: numbers as the files have them, and how close is close enough.

use coloc_estimator::angle::wrap;
use coloc_estimator::assist::datum::Reading;
use coloc_estimator::{Covariance3, GlobalPose, Parts, Pose};
use nalgebra::Matrix3;
use serde::Deserialize;

pub(crate) type Rows = [[f64; 3]; 3];

pub(crate) fn pose([x, y, phi]: [f64; 3]) -> Pose {
    Pose::new(x, y, phi)
}

pub(crate) fn matrix(rows: &Rows) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[i][j])
}

pub(crate) fn covariance(rows: &Rows) -> Covariance3 {
    Covariance3::new(matrix(rows)).unwrap()
}

/// `[xx, xy, xφ, yy, yφ, φφ]`
pub(crate) fn rows([xx, xy, xp, yy, yp, pp]: [f64; 6]) -> Rows {
    [[xx, xy, xp], [xy, yy, yp], [xp, yp, pp]]
}

/// y*, R* and `R_ind` as a datum has them.
pub(crate) fn datum(y_star: [f64; 3], R_star: &Rows, R_ind: &Rows) -> GlobalPose {
    GlobalPose {
        pose: pose(y_star),
        parts: Parts::of(&covariance(R_star), &covariance(R_ind)),
    }
}

#[derive(Deserialize)]
pub(crate) struct Seen {
    pub(crate) z: [f64; 3],
    pub(crate) R: Rows,
}

impl Seen {
    pub(crate) fn reading(&self) -> Reading {
        Reading {
            relative: pose(self.z),
            covariance: covariance(&self.R),
        }
    }
}

/// How far numbers may be off, and how far they were, as a part of it.
pub(crate) struct Tolerance {
    /// Of a coordinate, given its value and its σ.
    pub(crate) pose: fn(value: f64, sigma: f64) -> f64,
    /// Of a covariance: of the σ of both coordinates, and beside them.
    pub(crate) covariance: (f64, f64),
    worst: f64,
}

impl Tolerance {
    pub(crate) fn new(pose: fn(f64, f64) -> f64, covariance: (f64, f64)) -> Self {
        Self {
            pose,
            covariance,
            worst: 0.0,
        }
    }

    pub(crate) fn within(&mut self, name: &str, error: f64, allowed: f64) {
        assert!(
            error.abs() <= allowed,
            "{name} off by {error:e}, {allowed:e} allowed"
        );
        self.worst = self.worst.max(error.abs() / allowed);
    }

    pub(crate) fn pose(&mut self, name: &str, found: &Pose, expected: [f64; 3], of: [f64; 3]) {
        let errors = [
            found.x - expected[0],
            found.y - expected[1],
            wrap(found.phi - expected[2]),
        ];
        for i in 0..3 {
            let allowed = (self.pose)(expected[i], of[i]);
            self.within(&format!("{name}[{i}]"), errors[i], allowed);
        }
    }

    /// σ is that of the whole whose part the matrix is.
    pub(crate) fn matrix(
        &mut self,
        name: &str,
        found: &Matrix3<f64>,
        expected: &Rows,
        of: ([f64; 3], [f64; 3]),
    ) {
        let (relative, beside) = self.covariance;
        for i in 0..3 {
            for j in 0..3 {
                let error = found[(i, j)] - expected[i][j];
                let allowed = relative * of.0[i] * of.1[j] + beside;
                self.within(&format!("{name}[{i}][{j}]"), error, allowed);
            }
        }
    }

    /// What a run attained, for whoever reads its output.
    pub(crate) fn report(&self, name: &str) {
        println!("{name}: at most {:.2e} of the tolerance", self.worst);
    }
}

/// Standard deviations.
pub(crate) fn sigma(total: &Rows) -> [f64; 3] {
    std::array::from_fn(|i| total[i][i].max(0.0).sqrt())
}
