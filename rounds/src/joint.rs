//! One extended Kalman filter over the poses of several robots: `x = [x₁ … x_N]`, P with all cross-covariances \[B2\].
//!
//! Robots outside of it may be correlated with those inside. They are *considered*: their gain is zero, so nothing of them changes but
//! what they share with those inside, `C_l ← C_l (I − K H)ᵀ`.

use coloc_estimator::angle::wrap;
use coloc_estimator::{Motion, Pose};
use nalgebra::{Matrix2, Matrix3, Vector3};

use crate::model::{Kind, Prediction, predict};

/// What came of a measurement.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Whether it passed the gate.
    pub accepted: bool,
    /// Normalised innovation squared; infinite where there is none.
    pub d2: f64,
}

/// The filter.
#[derive(Clone, Debug)]
pub struct Joint {
    poses: Vec<Pose>,
    /// Row-major, 3N×3N, exactly symmetric.
    covariance: Vec<f64>,
    /// Row-major, any number of rows of 3N: covariances of what is outside with what is inside.
    outside: Vec<f64>,
    /// Columns of `P Hᵀ` and of the gain, kept to be used again.
    columns: Vec<[f64; 3]>,
    gain: Vec<[f64; 3]>,
}

impl Joint {
    /// Robots at these poses with these covariances, uncorrelated.
    #[must_use]
    pub fn new(robots: &[(Pose, Matrix3<f64>)]) -> Self {
        let size = 3 * robots.len();
        let mut joint = Self {
            poses: robots.iter().map(|(pose, _)| *pose).collect(),
            covariance: vec![0.0; size * size],
            outside: Vec::new(),
            columns: vec![[0.0; 3]; size],
            gain: vec![[0.0; 3]; size],
        };
        for (robot, (_, covariance)) in robots.iter().enumerate() {
            joint.set_block(robot, robot, covariance);
        }
        joint
    }

    fn size(&self) -> usize {
        3 * self.poses.len()
    }

    /// Where `robot` is believed to be.
    #[must_use]
    pub fn pose(&self, robot: usize) -> Pose {
        self.poses[robot]
    }

    /// `P_lm`.
    #[must_use]
    pub fn block(&self, l: usize, m: usize) -> Matrix3<f64> {
        let size = self.size();
        Matrix3::from_fn(|row, column| self.covariance[(3 * l + row) * size + 3 * m + column])
    }

    /// Sets `P_lm` and its mirror.
    pub fn set_block(&mut self, l: usize, m: usize, block: &Matrix3<f64>) {
        let size = self.size();
        for (row, column) in indices() {
            self.covariance[(3 * l + row) * size + 3 * m + column] = block[(row, column)];
            self.covariance[(3 * m + column) * size + 3 * l + row] = block[(row, column)];
        }
    }

    /// Adds a robot that stays outside, with its covariances with each inside.
    pub fn consider(&mut self, blocks: &[Matrix3<f64>]) {
        for row in 0..3 {
            let entries = blocks
                .iter()
                .flat_map(|block| (0..3).map(move |column| block[(row, column)]));
            self.outside.extend(entries);
        }
    }

    /// The covariance of the `l`-th robot outside with the `m`-th inside.
    #[must_use]
    pub fn considered(&self, l: usize, m: usize) -> Matrix3<f64> {
        let size = self.size();
        Matrix3::from_fn(|row, column| self.outside[(3 * l + row) * size + 3 * m + column])
    }

    /// Prediction of one robot: its rows and columns of P by the Jacobian, its block by the noise.
    pub fn propagate(&mut self, robot: usize, motion: &Motion, dt_s: f64) {
        let [vx, vy, omega] = motion.velocity();
        let Pose { x, y, phi } = self.poses[robot];
        let (sin, cos) = libm::sincos(phi);
        let [dx, dy] = [dt_s * (vx * cos - vy * sin), dt_s * (vx * sin + vy * cos)];
        self.poses[robot] = Pose::new(x + dx, y + dy, phi + dt_s * omega);
        let (size, first) = (self.size(), 3 * robot);
        for k in 0..size {
            let phi_row = self.covariance[(first + 2) * size + k];
            self.covariance[first * size + k] -= dy * phi_row;
            self.covariance[(first + 1) * size + k] += dx * phi_row;
        }
        for k in 0..size {
            let phi_column = self.covariance[k * size + first + 2];
            self.covariance[k * size + first] -= dy * phi_column;
            self.covariance[k * size + first + 1] += dx * phi_column;
        }
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let noise = turn * motion.covariance().matrix() * turn.transpose() * (dt_s * dt_s);
        for (row, column) in indices() {
            self.covariance[(first + row) * size + first + column] += noise[(row, column)];
        }
    }

    /// The pose of `r` in the frame of `q`, if d² is at most `gate`.
    pub fn relative_pose(
        &mut self,
        [q, r]: [usize; 2],
        seen: &Pose,
        noise: &Matrix3<f64>,
        gate: f64,
    ) -> Outcome {
        let expected = predict(Kind::Pose, &self.poses[q], &self.poses[r]);
        let Pose { x, y, phi } = *seen;
        let of = &expected.value;
        let innovation = Vector3::new(x - of.x, y - of.y, wrap(phi - of.z));
        let blocks = [(q, expected.first), (r, expected.second)];
        self.update(&blocks, &innovation, noise, gate)
    }

    /// Where `robot` is, as a measurement of three coordinates whose third says nothing.
    pub fn position(
        &mut self,
        robot: usize,
        position: [f64; 2],
        noise: &Matrix2<f64>,
        gate: f64,
    ) -> Outcome {
        let pose = self.poses[robot];
        let innovation = Vector3::new(position[0] - pose.x, position[1] - pose.y, 0.0);
        let h = Matrix3::from_diagonal(&[1.0, 1.0, 0.0].into());
        let a = noise;
        let noise = Matrix3::new(a.m11, a.m12, 0.0, a.m21, a.m22, 0.0, 0.0, 0.0, 1.0);
        self.update(&[(robot, h)], &innovation, &noise, gate)
    }

    /// Any measurement of `robots` (the second is not looked at where there is none); `noise` has its dimension, what is beyond is not
    /// looked at.
    pub fn measure(
        &mut self,
        kind: Kind,
        [a, b]: [usize; 2],
        y: [f64; 3],
        noise: &Matrix3<f64>,
        gate: f64,
    ) -> Outcome {
        let expected: Prediction = predict(kind, &self.poses[a], &self.poses[b]);
        let innovation = expected.residual(y);
        let of = kind.dimension();
        let noise = Matrix3::from_fn(|row, column| {
            if row.max(column) < of {
                noise[(row, column)]
            } else {
                f64::from(u8::from(row == column))
            }
        });
        let blocks = [(a, expected.first), (b, expected.second)];
        let used = 1 + usize::from(kind.is_of_two());
        self.update(&blocks[..used], &innovation, &noise, gate)
    }

    /// The Kalman update with `H` nonzero in the blocks given.
    fn update(
        &mut self,
        blocks: &[(usize, Matrix3<f64>)],
        innovation: &Vector3<f64>,
        noise: &Matrix3<f64>,
        gate: f64,
    ) -> Outcome {
        self.project(blocks);
        let mut s = *noise;
        for (robot, h) in blocks {
            let rows = &self.columns[3 * robot..3 * robot + 3];
            s += h * Matrix3::from_fn(|row, column| rows[row][column]);
        }
        let refused = |d2| Outcome {
            accepted: false,
            d2,
        };
        let Some(inverse) = (0.5 * (s + s.transpose()))
            .cholesky()
            .map(|root| root.inverse())
        else {
            return refused(f64::INFINITY);
        };
        let d2 = innovation.dot(&(inverse * innovation));
        if d2.is_nan() || d2 > gate {
            return refused(d2);
        }
        self.correct(blocks, &inverse, innovation);
        Outcome { accepted: true, d2 }
    }

    /// `columns := P Hᵀ`.
    fn project(&mut self, blocks: &[(usize, Matrix3<f64>)]) {
        let size = self.size();
        for (column, row) in self
            .columns
            .iter_mut()
            .zip(self.covariance.chunks_exact(size))
        {
            *column = projected(row, blocks).into();
        }
    }

    /// `x += K ν`, `P −= K (P Hᵀ)ᵀ`, `C −= (C Hᵀ) Kᵀ`, K = P Hᵀ S⁻¹.
    fn correct(
        &mut self,
        blocks: &[(usize, Matrix3<f64>)],
        inverse: &Matrix3<f64>,
        innovation: &Vector3<f64>,
    ) {
        for (gain, column) in self.gain.iter_mut().zip(&self.columns) {
            *gain = (inverse * Vector3::from(*column)).into();
        }
        for (pose, gain) in self.poses.iter_mut().zip(self.gain.chunks_exact(3)) {
            let step = |i: usize| Vector3::from(gain[i]).dot(innovation);
            *pose = Pose::new(pose.x + step(0), pose.y + step(1), pose.phi + step(2));
        }
        let size = self.size();
        for i in 0..size {
            for j in 0..=i {
                let [a, b] = [self.gain[i], self.columns[j]];
                let value =
                    self.covariance[i * size + j] - (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
                self.covariance[i * size + j] = value;
                self.covariance[j * size + i] = value;
            }
        }
        for row in self.outside.chunks_exact_mut(size.max(1)) {
            let seen = projected(row, blocks);
            for (entry, gain) in row.iter_mut().zip(&self.gain) {
                *entry -= seen.dot(&Vector3::from(*gain));
            }
        }
    }
}

/// `H` times a row of P.
fn projected(row: &[f64], blocks: &[(usize, Matrix3<f64>)]) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for (robot, h) in blocks {
        sum += h * Vector3::new(row[3 * robot], row[3 * robot + 1], row[3 * robot + 2]);
    }
    sum
}

fn indices() -> impl Iterator<Item = (usize, usize)> {
    (0..3).flat_map(|row| (0..3).map(move |column| (row, column)))
}
