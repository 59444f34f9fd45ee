//! Algorithms 1 and 2.

use coloc_estimator::{
    Belief, Covariance2, Covariance3, GlobalPose, Motion, Propagation, propagate, to_global,
};
use nalgebra::{Matrix2, Matrix3};
use serde::Deserialize;

use crate::case::{self, CUBATURE, File, Moments, Rows, covariance, sigma};
use crate::support::read_vectors;

#[derive(Deserialize)]
struct Propagated {
    #[serde(flatten)]
    prior: Moments,
    u: Vec<f64>,
    Q: Vec<Vec<f64>>,
    dt: f64,
}

impl Propagated {
    fn motion(&self) -> Motion {
        match *self.u.as_slice() {
            [v, omega] => Motion::Nonholonomic {
                velocity: [v, omega],
                noise: Covariance2::new(Matrix2::from_fn(|i, j| self.Q[i][j])).unwrap(),
            },
            [vx, vy, omega] => Motion::Holonomic {
                velocity: [vx, vy, omega],
                noise: Covariance3::new(Matrix3::from_fn(|i, j| self.Q[i][j])).unwrap(),
            },
            _ => panic!("{} velocities", self.u.len()),
        }
    }
}

#[test]
fn propagation() {
    let Some(file) = read_vectors::<File<Propagated, Moments>>("propagation.json") else {
        return;
    };
    assert!(!file.cases.is_empty());
    for case in &file.cases {
        let moved = propagate(
            &case.input.prior.belief(),
            &case.input.motion(),
            case.input.dt,
            Propagation::Paper,
        );
        CUBATURE.check(&case.name(), &moved, &case.expected);
    }
}

#[derive(Deserialize)]
struct Conversion {
    #[serde(flatten)]
    observer: Moments,
    y: [f64; 3],
    R: Rows,
}

#[derive(Deserialize)]
struct Converted {
    y_star: [f64; 3],
    R_star: Rows,
    R_ind: Rows,
    R_dep: Rows,
}

#[test]
fn conversion() {
    let Some(file) = read_vectors::<File<Conversion, Converted>>("conversion.json") else {
        return;
    };
    assert!(!file.cases.is_empty());
    for case in &file.cases {
        let Conversion { observer, y, R } = &case.input;
        let GlobalPose { pose, parts } = to_global(
            &observer.belief(),
            &case::pose(*y),
            &covariance(R),
            Propagation::Paper,
        );
        let Converted {
            y_star,
            R_star,
            R_ind,
            R_dep,
        } = &case.expected;
        let expected = Moments {
            x: *y_star,
            P: *R_star,
            P_ind: *R_ind,
        };
        CUBATURE.check(&case.name(), &Belief::gaussian(pose, parts), &expected);
        let dependent = parts.dependent.matrix();
        let sigma = sigma(R_star);
        for (i, row) in R_dep.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let error = dependent[(i, j)] - value;
                assert!(
                    error.abs() <= 1e-8 * sigma[i] * sigma[j] + 1e-18,
                    "{}: R_d",
                    case.name()
                );
            }
        }
    }
}
