//! The distributed Kalman filter to the letter: S. I. Roumeliotis, G. A. Bekey, "Distributed multirobot localization", IEEE Trans. Robotics
//! and Automation 18(5), 2002.
//!
//! The centralized filter, cut in pieces: robot l keeps `x̂_l`, `P_l` and of each other robot m a factor `A_lm`, with
//! `P_lm = A_lm A_mlᵀ`. Motion needs no message, because each robot turns its own factors: `A_lm ← Φ_l A_lm`. At a meeting the pair, every robot that is
//! correlated with either, and each pair of those exchange three rounds of messages, and what comes of it is the centralized filter's
//! estimate. If one of them cannot be reached, nothing comes of it: for robots that talk over a radio there are [`crate::rounds`].
//!
//! | paper | here |
//! | --- | --- |
//! | equations 5, 6: propagation | [`Node::propagate`] |
//! | equations 7 to 9: update | [`Team::update`] |
//! | section 5: observability | [`observability`] |

mod measurement;
mod node;
pub mod observability;
mod team;

pub use measurement::Measurement;
pub use node::{Node, Split};
pub use team::{Report, Team, Terms, Traffic, Verdict};

use coloc_estimator::{Belief, Motion, Pose};
use coloc_rounds::model::{Kind, drive};
use nalgebra::{DMatrix, Matrix2, Matrix3};

use crate::method::wheels::Wheels;
use crate::method::{FilterSettings, Innovation, Method, Sensor, Sent};
use crate::sensors::StepInputs;

/// Of any size, for measurements of any dimension.
pub type Matrix = DMatrix<f64>;

/// A pivot that is no more than this part of the largest variance is rounding.
const SINGULAR: f64 = 1e-12;

/// Half of it and of its transpose.
#[must_use]
pub fn symmetric(of: &Matrix) -> Matrix {
    0.5 * (of + of.transpose())
}

/// L of `P = L Lᵀ`; `None` where the pivots tell that the smallest eigenvalue may be 10⁻¹² of the largest or less.
#[must_use]
pub fn root(of: &Matrix) -> Option<Matrix> {
    let largest = of.diagonal().max();
    let root = of.clone().cholesky()?.unpack();
    let pivots = root.diagonal();
    let least = pivots
        .iter()
        .map(|it| it * it)
        .fold(f64::INFINITY, f64::min);
    (least > SINGULAR * largest).then_some(root)
}

/// `L⁻¹ right`; the diagonal of L, a [`root`], is not zero.
#[must_use]
pub fn solve_lower(root: &Matrix, right: &Matrix) -> Matrix {
    root.solve_lower_triangular(right)
        .unwrap_or_else(|| Matrix::from_element(right.nrows(), right.ncols(), f64::NAN))
}

/// A [`Team`] of planar robots, which sees what [`Joint`](crate::method::joint::Joint) sees, in the same order.
#[derive(Clone, Debug)]
pub struct Dkf {
    settings: FilterSettings,
    wheels: Vec<Wheels>,
    team: Team,
}

impl Dkf {
    /// A team that begins at `initial`, uncorrelated.
    #[must_use]
    pub fn new(settings: FilterSettings, initial: &[Belief]) -> Self {
        let robots = initial.iter().map(|belief| {
            let Pose { x, y, phi } = belief.pose;
            (vec![x, y, phi], block(&belief.total().matrix()))
        });
        Self {
            settings,
            wheels: vec![Wheels::default(); initial.len()],
            team: Team::new(robots.collect(), Split::Trivial),
        }
    }

    /// What was sent so far.
    #[must_use]
    pub fn traffic(&self) -> Traffic {
        self.team.traffic()
    }

    fn update(&mut self, measurement: &Measurement, gate: f64) -> (bool, f64) {
        let terms = Terms {
            gate,
            ..Terms::default()
        };
        let report = self.team.update(measurement, &terms);
        let d2 = report.d2.unwrap_or(f64::INFINITY);
        (report.verdict == Verdict::Applied, d2)
    }
}

/// The pose in a node's state.
#[must_use]
pub fn pose(node: &Node) -> Pose {
    match node.state[..] {
        [x, y, phi] => Pose::new(x, y, phi),
        _ => Pose::default(),
    }
}

/// Moves a planar robot on.
pub fn propagate(node: &mut Node, motion: &Motion, dt_s: f64) {
    let step = drive(&pose(node), motion, dt_s);
    let Pose { x, y, phi } = step.pose;
    node.propagate(vec![x, y, phi], &block(&step.jacobian), &block(&step.noise));
}

/// A 3×3 matrix.
#[must_use]
pub fn block(of: &Matrix3<f64>) -> Matrix {
    Matrix::from_fn(3, 3, |row, column| of[(row, column)])
}

/// A fix's R, in the corner of three.
fn widened(of: &Matrix2<f64>) -> Matrix3<f64> {
    Matrix3::new(of.m11, of.m12, 0.0, of.m21, of.m22, 0.0, 0.0, 0.0, 0.0)
}

impl Method for Dkf {
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        for (robot, reported) in inputs.odometry.iter().enumerate() {
            let motion = self.wheels[robot].motion(*reported, &self.settings);
            propagate(&mut self.team.nodes[robot], &motion, self.settings.dt_s);
        }
        let heard = inputs.sightings.iter().filter(|it| it.arrives.is_some());
        for seen in heard {
            let robots = [seen.observer, seen.observed];
            let [a, b] = robots.map(|it| pose(&self.team.nodes[it]));
            let y = seen.relative.to_vector().into();
            let noise = self.settings.relative.matrix();
            let measurement = Measurement::of(Kind::Pose, robots, [&a, &b], y, &noise);
            let (accepted, d2) = self.update(&measurement, self.settings.product.fusion.gate);
            log(Innovation {
                sensor: Sensor::Neighbour,
                robot: seen.observed,
                accepted,
                d2,
            });
        }
        for fix in &inputs.fixes {
            let [x, y] = fix.position;
            let at = pose(&self.team.nodes[fix.robot]);
            let noise = widened(&self.settings.fix.matrix());
            let robots = [fix.robot; 2];
            let measurement =
                Measurement::of(Kind::Position, robots, [&at, &at], [x, y, 0.0], &noise);
            let (accepted, d2) = self.update(&measurement, self.settings.product.position_gate);
            log(Innovation {
                sensor: Sensor::Fix,
                robot: fix.robot,
                accepted,
                d2,
            });
        }
    }

    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        let node = &self.team.nodes[robot];
        let covariance = Matrix3::from_fn(|row, column| node.covariance[(row, column)]);
        (pose(node), covariance)
    }

    fn sent(&self) -> Option<Sent> {
        let Traffic {
            messages, numbers, ..
        } = self.traffic();
        Some(Sent {
            messages: messages as u64,
            bytes: 8 * numbers as u64,
        })
    }
}
