//! Centralized cooperative localization: one extended Kalman filter over the poses of the whole team.
//!
//! ```text
//! x = [x₁ … x_N], P 3N×3N with all cross-covariances
//! relative pose of r seen by q: h = Γ(φ_q)ᵀ (x_r − x_q)
//! H_q = −[c s −h_y; −s c h_x; 0 0 1], H_r = [c s 0; −s c 0; 0 0 1], c = cos φ_q, s = sin φ_q
//! ```
//!
//! It hears every message that is not lost, at once: a bound that no decentralized method can reach.

use coloc_estimator::{Belief, Pose};
use coloc_rounds::Outcome;
use nalgebra::Matrix3;

use super::wheels::Wheels;
use super::{FilterSettings, Innovation, Method, Sensor};
use crate::sensors::{Fix, Sighting, StepInputs};

/// The team's filter.
#[derive(Clone, Debug)]
pub struct Joint {
    settings: FilterSettings,
    wheels: Vec<Wheels>,
    filter: coloc_rounds::Joint,
}

impl Joint {
    /// A team that begins at `initial`, uncorrelated.
    #[must_use]
    pub fn new(settings: FilterSettings, initial: &[Belief]) -> Self {
        let robots: Vec<_> = initial
            .iter()
            .map(|belief| (belief.pose, belief.total().matrix()))
            .collect();
        Self {
            settings,
            wheels: vec![Wheels::default(); initial.len()],
            filter: coloc_rounds::Joint::new(&robots),
        }
    }

    /// The pose of `seen.observed` in the frame of `seen.observer`.
    fn relative_pose(&mut self, seen: &Sighting) -> Outcome {
        let noise = self.settings.relative.matrix();
        let gate = self.settings.product.fusion.gate;
        let robots = [seen.observer, seen.observed];
        self.filter
            .relative_pose(robots, &seen.relative, &noise, gate)
    }

    fn position(&mut self, fix: &Fix) -> Outcome {
        let gate = self.settings.product.position_gate;
        let noise = self.settings.fix.matrix();
        self.filter.position(fix.robot, fix.position, &noise, gate)
    }
}

impl Method for Joint {
    fn step(&mut self, inputs: &StepInputs, log: &mut dyn FnMut(Innovation)) {
        for (robot, reported) in inputs.odometry.iter().enumerate() {
            let motion = self.wheels[robot].motion(*reported, &self.settings);
            self.filter.propagate(robot, &motion, self.settings.dt_s);
        }
        for seen in inputs
            .sightings
            .iter()
            .filter(|seen| seen.arrives.is_some())
        {
            let Outcome { accepted, d2 } = self.relative_pose(seen);
            log(Innovation {
                sensor: Sensor::Neighbour,
                robot: seen.observed,
                accepted,
                d2,
            });
        }
        for fix in &inputs.fixes {
            let Outcome { accepted, d2 } = self.position(fix);
            log(Innovation {
                sensor: Sensor::Fix,
                robot: fix.robot,
                accepted,
                d2,
            });
        }
    }

    fn estimate(&self, robot: usize) -> (Pose, Matrix3<f64>) {
        (self.filter.pose(robot), self.filter.block(robot, robot))
    }
}
