//! A belief as the vectors of [`coloc_estimator::honest`] and [`coloc_estimator::partial`] have it.

use coloc_estimator::{Belief, Bend, Covariance2, Covariance3, Parts, Pose};
use serde::Deserialize;

pub(crate) type Rows = [[f64; 3]; 3];
pub(crate) type Rows2 = [[f64; 2]; 2];

/// A belief, or a part of it.
#[derive(Deserialize)]
pub(crate) struct State {
    pub(crate) x: [f64; 3],
    pub(crate) P_i: Rows,
    pub(crate) P_d: Rows,
    /// Columns in the axes of the common frame.
    pub(crate) K_H: [[f64; 2]; 3],
}

impl State {
    pub(crate) fn belief(&self) -> Belief {
        Belief {
            pose: pose(self.x),
            parts: parts(&self.P_i, &self.P_d),
            bend: self.bend(),
        }
    }

    /// `[k_a k_b] = K_H R(φ̄)`
    fn bend(&self) -> Bend {
        let (sin, cos) = self.x[2].sin_cos();
        Bend {
            along: self.K_H.map(|[x, y]| x * cos + y * sin),
            across: self.K_H.map(|[x, y]| y * cos - x * sin),
        }
    }
}

/// `[k_a k_b] R(φ̄)ᵀ`
pub(crate) fn in_common_axes(belief: &Belief) -> [[f64; 2]; 3] {
    let (sin, cos) = belief.pose.phi.sin_cos();
    let Bend { along, across } = belief.bend;
    std::array::from_fn(|i| {
        let (a, b) = (along[i], across[i]);
        [a * cos - b * sin, a * sin + b * cos]
    })
}

pub(crate) fn pose([x, y, phi]: [f64; 3]) -> Pose {
    Pose::new(x, y, phi)
}

fn row_major(rows: &Rows) -> [f64; 9] {
    rows.as_flattened().try_into().unwrap()
}

pub(crate) fn parts(independent: &Rows, dependent: &Rows) -> Parts {
    Parts::from_row_major(row_major(independent), row_major(dependent)).unwrap()
}

pub(crate) fn covariance(rows: &Rows) -> Covariance3 {
    Covariance3::from_row_major(row_major(rows)).unwrap()
}

pub(crate) fn covariance2(rows: &Rows2) -> Covariance2 {
    Covariance2::from_row_major(rows.as_flattened().try_into().unwrap()).unwrap()
}
