//! Centralized cooperative localization: one extended Kalman filter over the poses of the whole team.
//!
//! ```text
//! x = [x₁ … x_N], P 3N×3N with all cross-covariances
//! relative pose of r seen by q: h = Γ(φ_q)ᵀ (x_r − x_q)
//! H_q = −[c s −h_y; −s c h_x; 0 0 1], H_r = [c s 0; −s c 0; 0 0 1], c = cos φ_q, s = sin φ_q
//! ```
//!
//! It hears every message that is not lost, at once: a bound that no decentralized method can reach.

use coloc_estimator::angle::wrap;
use coloc_estimator::{Belief, Motion, Pose};
use nalgebra::{Matrix3, Vector3};

use super::wheels::Wheels;
use super::{FilterSettings, Innovation, Method, Sensor};
use crate::sensors::{Fix, Sighting, StepInputs, relative};

/// The team's filter.
#[derive(Clone, Debug)]
pub struct Joint {
    settings: FilterSettings,
    poses: Vec<Pose>,
    wheels: Vec<Wheels>,
    /// Row-major, 3N×3N, exactly symmetric.
    covariance: Vec<f64>,
    /// Columns of `P Hᵀ` and of the gain, kept to be used again.
    columns: Vec<[f64; 3]>,
    gain: Vec<[f64; 3]>,
}

impl Joint {
    /// A team that begins at `initial`, uncorrelated.
    #[must_use]
    pub fn new(settings: FilterSettings, initial: &[Belief]) -> Self {
        let size = 3 * initial.len();
        let mut covariance = vec![0.0; size * size];
        for (robot, belief) in initial.iter().enumerate() {
            for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
                covariance[(3 * robot + row) * size + 3 * robot + column] =
                    belief.total().matrix()[(row, column)];
            }
        }
        Self {
            settings,
            poses: initial.iter().map(|belief| belief.pose).collect(),
            wheels: vec![Wheels::default(); initial.len()],
            covariance,
            columns: vec![[0.0; 3]; size],
            gain: vec![[0.0; 3]; size],
        }
    }

    fn size(&self) -> usize {
        3 * self.poses.len()
    }

    /// Prediction of one robot: its rows and columns of P by the Jacobian, its block by the noise.
    fn propagate(&mut self, robot: usize, motion: &Motion) {
        let dt_s = self.settings.dt_s;
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
        let noise = noise_in_world(motion, sin, cos) * (dt_s * dt_s);
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            self.covariance[(first + row) * size + first + column] += noise[(row, column)];
        }
    }

    /// The pose of `seen.observed` in the frame of `seen.observer`.
    fn relative_pose(&mut self, seen: &Sighting) -> (bool, f64) {
        let (q, r) = (seen.observer, seen.observed);
        let expected = relative(&self.poses[q], &self.poses[r]);
        let (s, c) = libm::sincos(self.poses[q].phi);
        let h_r = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
        let h_q = -Matrix3::new(c, s, -expected.y, -s, c, expected.x, 0.0, 0.0, 1.0);
        let Pose { x, y, phi } = seen.relative;
        let innovation = Vector3::new(x - expected.x, y - expected.y, wrap(phi - expected.phi));
        let noise = self.settings.relative.matrix();
        self.update(
            &[(q, h_q), (r, h_r)],
            &innovation,
            &noise,
            self.settings.product.fusion.gate,
        )
    }

    /// A fix, as a measurement of three coordinates whose third says nothing.
    fn position(&mut self, fix: &Fix) -> (bool, f64) {
        let pose = self.poses[fix.robot];
        let innovation = Vector3::new(fix.position[0] - pose.x, fix.position[1] - pose.y, 0.0);
        let h = Matrix3::from_diagonal(&[1.0, 1.0, 0.0].into());
        let a = self.settings.fix.matrix();
        let noise = Matrix3::new(a.m11, a.m12, 0.0, a.m21, a.m22, 0.0, 0.0, 0.0, 1.0);
        self.update(
            &[(fix.robot, h)],
            &innovation,
            &noise,
            self.settings.product.position_gate,
        )
    }

    /// The Kalman update with `H` nonzero in the blocks given; whether it passed the gate, and d².
    fn update(
        &mut self,
        blocks: &[(usize, Matrix3<f64>)],
        innovation: &Vector3<f64>,
        noise: &Matrix3<f64>,
        gate: f64,
    ) -> (bool, f64) {
        self.project(blocks);
        let mut s = *noise;
        for (robot, h) in blocks {
            let rows = &self.columns[3 * robot..3 * robot + 3];
            s += h * Matrix3::from_fn(|row, column| rows[row][column]);
        }
        let Some(inverse) = (0.5 * (s + s.transpose()))
            .cholesky()
            .map(|root| root.inverse())
        else {
            return (false, f64::INFINITY);
        };
        let d2 = innovation.dot(&(inverse * innovation));
        if d2 > gate {
            return (false, d2);
        }
        self.correct(&inverse, innovation);
        (true, d2)
    }

    /// `columns := P Hᵀ`.
    fn project(&mut self, blocks: &[(usize, Matrix3<f64>)]) {
        let size = self.size();
        for (column, row) in self
            .columns
            .iter_mut()
            .zip(self.covariance.chunks_exact(size))
        {
            let mut sum = Vector3::zeros();
            for (robot, h) in blocks {
                sum += h * Vector3::new(row[3 * robot], row[3 * robot + 1], row[3 * robot + 2]);
            }
            *column = sum.into();
        }
    }

    /// `x += K ν`, `P −= K (P Hᵀ)ᵀ`, K = P Hᵀ S⁻¹.
    fn correct(&mut self, inverse: &Matrix3<f64>, innovation: &Vector3<f64>) {
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
    }
}

/// Q turned into the common frame.
fn noise_in_world(motion: &Motion, sin: f64, cos: f64) -> Matrix3<f64> {
    let body = match motion {
        Motion::Nonholonomic { noise, .. } => {
            let q = noise.matrix();
            Matrix3::new(q.m11, 0.0, q.m12, 0.0, 0.0, 0.0, q.m21, 0.0, q.m22)
        }
        Motion::Holonomic { noise, .. } => noise.matrix(),
    };
    let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    turn * body * turn.transpose()
}

impl Method for Joint {
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        for (robot, reported) in inputs.odometry.iter().enumerate() {
            let motion = self.wheels[robot].motion(*reported, &self.settings);
            self.propagate(robot, &motion);
        }
        for seen in inputs
            .sightings
            .iter()
            .filter(|seen| seen.arrives.is_some())
        {
            let (accepted, d2) = self.relative_pose(seen);
            log(Innovation {
                sensor: Sensor::Neighbour,
                robot: seen.observed,
                accepted,
                d2,
            });
        }
        for fix in &inputs.fixes {
            let (accepted, d2) = self.position(fix);
            log(Innovation {
                sensor: Sensor::Fix,
                robot: fix.robot,
                accepted,
                d2,
            });
        }
    }

    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        let (size, first) = (self.size(), 3 * robot);
        let block =
            |row: usize, column: usize| self.covariance[(first + row) * size + first + column];
        (self.poses[robot], Matrix3::from_fn(block))
    }
}
