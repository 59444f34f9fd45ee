//! A Kalman filter along the estimator's own step, with what a calibration needs beside it: the receivers' slow errors, and what
//! their place on the robot has to do with its heading. Between fixes it is [`honest::advance`] that moves the belief; its map
//! carries the correlation with the slow errors along. At a fix the bend of the belief is dropped: a heading is known to a few
//! degrees here, and at 0.1 rad the bend makes half a per cent of the variance across.

use coloc_estimator::honest::{self, Map};
use coloc_estimator::{Belief, Covariance3, Pose};

use crate::drive::{Drive, Fix};
use crate::robot::{Receiver, Robot, Step};

/// Nothing is known of where the drive began but that it is about where the first fix is \[m\].
const BEGIN_SIGMA_M: f64 = 100.0;

/// A measurement less what was expected of it, and the variance of that.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Innovation {
    /// Of east and north; of a difference of turns the first alone.
    pub(crate) off: [f64; 2],
    /// Row-major; of a difference of turns `[s, 0, 0, 1]`.
    pub(crate) covariance: [f64; 4],
}

/// A slow error.
#[derive(Clone, Debug)]
struct Slow {
    mean: [f64; 2],
    /// With the pose, by coordinate of the error.
    with_pose: [[f64; 3]; 2],
}

/// The pose and the slow errors.
#[derive(Clone, Debug)]
pub(crate) struct Filter<'a> {
    robot: &'a Robot,
    belief: Belief,
    slow: Vec<Slow>,
    /// Of the slow errors, row-major.
    among: Vec<f64>,
    /// Of the slow errors \[s\].
    now_s: f64,
}

impl<'a> Filter<'a> {
    pub(crate) fn new(robot: &'a Robot, drive: &Drive) -> Self {
        let [x, y] = drive.fixes().first().map_or([0.0; 2], |fix| fix.position);
        let variance = BEGIN_SIGMA_M * BEGIN_SIGMA_M;
        let about = Covariance3::diagonal([variance, variance, 0.0]).unwrap_or(Covariance3::ZERO);
        let size = 2 * robot.receivers.len();
        let mut filter = Self {
            robot,
            belief: Belief::independent(Pose::new(x, y, robot.heading_rad), about),
            slow: vec![
                Slow {
                    mean: [0.0; 2],
                    with_pose: [[0.0; 3]; 2],
                };
                robot.receivers.len()
            ],
            among: vec![0.0; size * size],
            now_s: drive.begin_s(),
        };
        for (index, receiver) in robot.receivers.iter().enumerate() {
            for axis in [2 * index, 2 * index + 1] {
                filter.among[axis * size + axis] = receiver.slow_sigma_m * receiver.slow_sigma_m;
            }
        }
        filter
    }

    /// A part of a step.
    pub(crate) fn advance(&mut self, step: &Step, part: f64) {
        let moved = honest::advance(&self.belief, &step.increments(part));
        let Map {
            by_heading: [ax, ay],
        } = moved.map;
        self.belief = moved.belief;
        for slow in &mut self.slow {
            for [x, y, heading] in &mut slow.with_pose {
                *x += ax * *heading;
                *y += ay * *heading;
            }
        }
    }

    /// The slow errors at a later moment.
    fn forget_until(&mut self, time_s: f64) {
        let dt_s = time_s - self.now_s;
        self.now_s = time_s;
        let size = 2 * self.slow.len();
        let kept = |receiver: &Receiver| match receiver.slow_time_s {
            time_s if time_s > 0.0 => libm::exp(-dt_s.max(0.0) / time_s),
            _ => 0.0,
        };
        let kept: Vec<f64> = self.robot.receivers.iter().map(kept).collect();
        for (slow, kept) in self.slow.iter_mut().zip(&kept) {
            slow.mean = slow.mean.map(|it| it * kept);
            slow.with_pose = slow.with_pose.map(|column| column.map(|it| it * kept));
        }
        for row in 0..size {
            for column in 0..size {
                self.among[row * size + column] *= kept[row / 2] * kept[column / 2];
            }
            let (sigma, kept) = (self.robot.receivers[row / 2].slow_sigma_m, kept[row / 2]);
            self.among[row * size + row] += sigma * sigma * (1.0 - kept * kept);
        }
    }

    /// What is expected of a fix now, less which it is, and how all of the state lies to it: `P Hᵀ`, by coordinate.
    fn compare(&self, fix: &Fix) -> (Innovation, [Vec<f64>; 2]) {
        let receiver = &self.robot.receivers[fix.receiver];
        let Pose { x, y, phi } = self.belief.pose;
        let (sin, cos) = libm::sincos(phi);
        let [forward, left] = receiver.lever_m;
        let arm = [cos * forward - sin * left, sin * forward + cos * left];
        let by_heading = [-arm[1], arm[0]];
        let slow = &self.slow[fix.receiver];
        let own = [x + arm[0] + slow.mean[0], y + arm[1] + slow.mean[1]];
        let lies = [0, 1].map(|axis| self.lies(axis, by_heading[axis], fix.receiver));
        let expected = |axis: usize, column: &[f64]| {
            column[axis] + by_heading[axis] * column[2] + column[3 + 2 * fix.receiver + axis]
        };
        let noise = receiver.sigma_m * receiver.sigma_m;
        let crossed = expected(0, &lies[1]);
        let innovation = Innovation {
            off: [fix.position[0] - own[0], fix.position[1] - own[1]],
            covariance: [
                expected(0, &lies[0]) + noise,
                crossed,
                crossed,
                expected(1, &lies[1]) + noise,
            ],
        };
        (innovation, lies)
    }

    /// `P hᵀ` of a coordinate of a fix.
    fn lies(&self, axis: usize, by_heading: f64, receiver: usize) -> Vec<f64> {
        let pose = self.belief.total().to_row_major();
        let with = &self.slow[receiver].with_pose[axis];
        let mut column: Vec<f64> = (0..3)
            .map(|row| pose[3 * row + axis] + by_heading * pose[3 * row + 2] + with[row])
            .collect();
        let size = 2 * self.slow.len();
        for row in 0..size {
            let [x, y, heading] = self.slow[row / 2].with_pose[row % 2];
            let position = [x, y][axis];
            let among = self.among[row * size + 2 * receiver + axis];
            column.push(position + by_heading * heading + among);
        }
        column
    }

    /// What a fix would say now, if it were not taken in.
    pub(crate) fn foresee(&mut self, fix: &Fix, time_s: f64) -> Innovation {
        self.forget_until(time_s);
        self.compare(fix).0
    }

    /// Takes a fix in; nothing where the numbers give out.
    pub(crate) fn correct(&mut self, fix: &Fix, time_s: f64) -> Option<Innovation> {
        self.forget_until(time_s);
        let (innovation, lies) = self.compare(fix);
        let inverse = innovation.inverse()?;
        let gain: Vec<[f64; 2]> = (0..lies[0].len())
            .map(|row| {
                let [a, b] = [lies[0][row], lies[1][row]];
                [
                    a * inverse[0] + b * inverse[2],
                    a * inverse[1] + b * inverse[3],
                ]
            })
            .collect();
        let [dx, dy] = innovation.off;
        let moved: Vec<f64> = gain.iter().map(|[a, b]| a * dx + b * dy).collect();
        let taken = |row: usize, column: usize| {
            gain[row][0] * lies[0][column] + gain[row][1] * lies[1][column]
        };
        self.take(&moved, taken)?;
        Some(innovation)
    }

    /// Moves the mean, and takes `taken` off the covariance.
    fn take(&mut self, moved: &[f64], taken: impl Fn(usize, usize) -> f64) -> Option<()> {
        let before = self.belief.total().to_row_major();
        let mut after = [0.0; 9];
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            let both = 0.5 * (taken(row, column) + taken(column, row));
            after[3 * row + column] = before[3 * row + column] - both;
        }
        let covariance = Covariance3::from_row_major(after).ok()?;
        let Pose { x, y, phi } = self.belief.pose;
        let pose = Pose::new(x + moved[0], y + moved[1], phi + moved[2]);
        self.belief = Belief::independent(pose, covariance);
        let size = 2 * self.slow.len();
        for row in 0..size {
            let slow = &mut self.slow[row / 2];
            slow.mean[row % 2] += moved[3 + row];
            for (entry, it) in slow.with_pose[row % 2].iter_mut().enumerate() {
                *it -= taken(entry, 3 + row);
            }
            for column in 0..size {
                let both = 0.5 * (taken(3 + row, 3 + column) + taken(3 + column, 3 + row));
                self.among[row * size + column] -= both;
            }
        }
        Some(())
    }
}

impl Innovation {
    /// Of the turns of wheels and gyro.
    pub(crate) fn of_parting([off, variance]: [f64; 2]) -> Self {
        Self {
            off: [off, 0.0],
            covariance: [variance, 0.0, 0.0, 1.0],
        }
    }

    pub(crate) fn determinant(&self) -> f64 {
        let [a, b, c, d] = self.covariance;
        a * d - b * c
    }

    pub(crate) fn inverse(&self) -> Option<[f64; 4]> {
        let [a, b, c, d] = self.covariance;
        let determinant = self.determinant();
        let regular = determinant.is_finite() && determinant > 0.0;
        regular.then(|| [d, -b, -c, a].map(|it| it / determinant))
    }

    /// `νᵀ S⁻¹ ν`
    pub(crate) fn squared(&self) -> Option<f64> {
        let [x, y] = self.off;
        self.inverse()
            .map(|[a, b, c, d]| x * (a * x + b * y) + y * (c * x + d * y))
    }
}
