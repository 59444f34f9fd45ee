//! One update's measurement: rows of H for each robot that takes part, residual and R; several stacked are a batch.

use coloc_estimator::Pose;
use coloc_rounds::model::{Kind, predict};
use nalgebra::Matrix3;

use super::Matrix;

/// A measurement, linearised.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// Who measures or is measured, ascending, and its H.
    pub jacobians: Vec<(usize, Matrix)>,
    /// A column.
    pub residual: Matrix,
    /// R
    pub noise: Matrix,
}

impl Measurement {
    /// How many numbers were measured.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.residual.nrows()
    }

    /// H of `robot`, if it measures or is measured.
    #[must_use]
    pub fn jacobian(&self, robot: usize) -> Option<&Matrix> {
        let mut all = self.jacobians.iter();
        all.find(|(it, _)| *it == robot).map(|(_, h)| h)
    }

    /// Of `kind` between robots of given poses; of `noise` as much is used as it has dimensions.
    #[must_use]
    pub fn of(
        kind: Kind,
        robots: [usize; 2],
        poses: [&Pose; 2],
        y: [f64; 3],
        noise: &Matrix3<f64>,
    ) -> Self {
        let expected = predict(kind, poses[0], poses[1]);
        let rows = kind.dimension();
        let residual = expected.residual(y);
        let block = |of: &Matrix3<f64>| Matrix::from_fn(rows, 3, |i, j| of[(i, j)]);
        let mut jacobians = vec![(robots[0], block(&expected.first))];
        if kind.is_of_two() {
            jacobians.push((robots[1], block(&expected.second)));
        }
        jacobians.sort_by_key(|(robot, _)| *robot);
        Self {
            jacobians,
            residual: Matrix::from_fn(rows, 1, |row, _| residual[row]),
            noise: Matrix::from_fn(rows, rows, |i, j| noise[(i, j)]),
        }
    }

    /// Several as one, their errors independent.
    #[must_use]
    pub fn batch(parts: &[Self]) -> Self {
        let size = parts.iter().map(Self::dimension).sum();
        let mut robots: Vec<usize> = parts
            .iter()
            .flat_map(|part| part.jacobians.iter().map(|(robot, _)| *robot))
            .collect();
        robots.sort_unstable();
        robots.dedup();
        let mut batch = Self {
            jacobians: Vec::new(),
            residual: Matrix::zeros(size, 1),
            noise: Matrix::zeros(size, size),
        };
        for robot in robots {
            let (mut stacked, mut row) = (Matrix::zeros(0, 0), 0);
            for part in parts {
                if let Some(h) = part.jacobian(robot) {
                    if stacked.is_empty() {
                        stacked = Matrix::zeros(size, h.ncols());
                    }
                    stacked.view_mut((row, 0), h.shape()).copy_from(h);
                }
                row += part.dimension();
            }
            batch.jacobians.push((robot, stacked));
        }
        let mut row = 0;
        for part in parts {
            let size = part.dimension();
            let mut residual = batch.residual.rows_mut(row, size);
            residual.copy_from(&part.residual);
            let mut noise = batch.noise.view_mut((row, row), (size, size));
            noise.copy_from(&part.noise);
            row += size;
        }
        batch
    }
}
