//! Single localization as the paper's figures were made: the mean by plain integration, P by its Jacobians.

use coloc_estimator::fix as position_fix;
use coloc_estimator::{Belief, Covariance3, Motion, Pose};
use nalgebra::{Matrix2, Matrix3, Matrix3x2};

use super::wheels::Wheels;
use super::{FilterSettings, Innovation, Method, Sensor};
use crate::dead_reckoning::euler_step;
use crate::sensors::StepInputs;

/// A team of robots each of which is alone.
#[derive(Clone, Debug)]
pub struct Plain {
    settings: FilterSettings,
    robots: Vec<(Belief, Wheels)>,
}

impl Plain {
    /// A team that begins at `initial`.
    #[must_use]
    pub fn new(settings: FilterSettings, initial: &[Belief]) -> Self {
        let alone = |belief: &Belief| {
            (
                Belief::independent(belief.pose, belief.total()),
                Wheels::default(),
            )
        };
        Self {
            settings,
            robots: initial.iter().map(alone).collect(),
        }
    }
}

/// `P⁻ = F P Fᵀ + G Q Gᵀ`.
fn integrate(belief: &Belief, motion: &Motion, dt_s: f64) -> Belief {
    let [v, sideways, omega] = motion.velocity();
    let (sin, cos) = libm::sincos(belief.pose.phi);
    let jacobian = Matrix3::new(
        1.0,
        0.0,
        -dt_s * v * sin,
        0.0,
        1.0,
        dt_s * v * cos,
        0.0,
        0.0,
        1.0,
    );
    let noise = match motion {
        Motion::Nonholonomic { noise, .. } => {
            let gain = Matrix3x2::new(cos, 0.0, sin, 0.0, 0.0, 1.0) * dt_s;
            gain * noise.matrix() * gain.transpose()
        }
        Motion::Holonomic { noise, .. } => {
            let turn = Matrix2::new(cos, -sin, sin, cos)
                .insert_row(2, 0.0)
                .insert_column(2, 0.0);
            let gain = (turn + Matrix3::from_diagonal(&[0.0, 0.0, 1.0].into())) * dt_s;
            gain * noise.matrix() * gain.transpose()
        }
    };
    let total = jacobian * belief.total().matrix() * jacobian.transpose() + noise;
    let total = Covariance3::new(0.5 * (total + total.transpose())).unwrap_or(belief.total());
    debug_assert!(
        sideways.abs() < f64::EPSILON,
        "wheels do not report sideways motion"
    );
    Belief::independent(euler_step(&belief.pose, [v, omega], dt_s), total)
}

impl Method for Plain {
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        for ((belief, wheels), reported) in self.robots.iter_mut().zip(&inputs.odometry) {
            let motion = wheels.motion(*reported, &self.settings);
            *belief = integrate(belief, &motion, self.settings.dt_s);
        }
        for fix in &inputs.fixes {
            let (belief, _) = &mut self.robots[fix.robot];
            let update = position_fix::update(
                belief,
                fix.position,
                &self.settings.fix,
                self.settings.product.position_gate,
            );
            let (accepted, d2) = (update.accepted, update.d2);
            log(Innovation {
                sensor: Sensor::Fix,
                robot: fix.robot,
                accepted,
                d2,
            });
            *belief = update.belief;
        }
    }

    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        let belief = &self.robots[robot].0;
        (belief.pose, belief.total().matrix())
    }
}
