//! Who dead reckons.

use coloc_estimator::{
    Belief, Bend, Covariance3, Increments, Motion, Pose, Propagation, propagate,
};
use nalgebra::Matrix3;

/// The estimator, and those that forget at every step how the distribution bends.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The estimator: the bend is carried.
    Carried,
    /// The exact first two moments of every step, and a Gaussian made of them.
    Exact,
    /// The paper's cubature transform, from the heading at the start of the step.
    Cubature,
    /// An extended Kalman filter on arcs.
    Extended,
}

impl Filter {
    /// All of them, the estimator last, as in tables.
    pub const ALL: [Self; 4] = [Self::Extended, Self::Cubature, Self::Exact, Self::Carried];

    /// For people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Carried => "coloc",
            Self::Exact => "exact per tick",
            Self::Cubature => "cubature",
            Self::Extended => "EKF",
        }
    }

    /// After a step.
    #[must_use]
    pub fn step(self, belief: &Belief, motion: &Motion, dt_s: f64) -> Belief {
        match self {
            Self::Carried => propagate(belief, motion, dt_s, Propagation::Honest),
            Self::Exact => straightened(&propagate(belief, motion, dt_s, Propagation::Honest)),
            Self::Cubature => propagate(belief, motion, dt_s, Propagation::Paper),
            Self::Extended => linearized(belief, motion, dt_s),
        }
    }
}

/// As if it were a Gaussian.
#[must_use]
pub(super) fn straightened(belief: &Belief) -> Belief {
    Belief {
        bend: Bend::ZERO,
        ..*belief
    }
}

/// `P⁺ = F P Fᵀ + G D Gᵀ` at the mean.
fn linearized(belief: &Belief, motion: &Motion, dt_s: f64) -> Belief {
    let held = motion.velocity().map(|it| dt_s * it);
    let arc = Increments::arc(held, &motion.covariance().scaled(dt_s * dt_s));
    let [x, y] = arc.translation;
    let (sin, cos) = libm::sincos(belief.pose.phi);
    let way = [cos * x - sin * y, sin * x + cos * y];
    let by_heading = Matrix3::new(1.0, 0.0, -way[1], 0.0, 1.0, way[0], 0.0, 0.0, 1.0);
    let turned = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    let before = belief.total();
    let p = by_heading * before.matrix() * by_heading.transpose()
        + turned * arc.noise.matrix() * turned.transpose();
    let Pose { x, y, phi } = belief.pose;
    Belief::independent(
        Pose::new(x + way[0], y + way[1], phi + arc.turn),
        Covariance3::new(0.5 * (p + p.transpose())).unwrap_or(before),
    )
}
