//! Where the wheels alone would put a robot: the yardstick that every recording's description states.

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;

use crate::mrclam::{GridWorld, OdometryRow, RobotRecord};
use crate::world::World;

/// Root mean square over time of each coordinate's error.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct RmsError {
    /// \[m\]
    pub x_m: f64,
    /// \[m\]
    pub y_m: f64,
    /// Of the wrapped difference \[rad\].
    pub phi_rad: f64,
}

/// Forward Euler over a world's odometry from the robot's first true pose, compared where the truth is known.
#[must_use]
pub fn euler(world: &impl World, robot: usize) -> RmsError {
    let mut errors = Errors::default();
    let Some(mut pose) = world.initial(robot) else {
        return errors.rms();
    };
    for step in 0..world.steps() {
        if let Some(truth) = world.truth(step, robot) {
            errors.add(&pose, &truth);
        }
        pose = euler_step(&pose, world.odometry(step, robot), world.dt_s());
    }
    errors.rms()
}

/// One step of forward Euler: `x + δt v cos φ`, `y + δt v sin φ`, `φ + δt ω` \[1\].
#[must_use]
pub fn euler_step(pose: &Pose, [v, omega]: [f64; 2], dt_s: f64) -> Pose {
    let (sin, cos) = libm::sincos(pose.phi);
    Pose::new(
        pose.x + dt_s * v * cos,
        pose.y + dt_s * v * sin,
        pose.phi + dt_s * omega,
    )
}

/// Each raw odometry row held until the next one, on exact arcs, from the true pose at the first row; compared on the
/// 50 Hz grid of `world` (the same recording's), where the truth is known.
#[must_use]
pub fn held_arcs(record: &RobotRecord, world: &GridWorld, robot: usize) -> RmsError {
    let mut errors = Errors::default();
    let mut rows = record.odometry.iter().peekable();
    let begin_s = rows.peek().map_or(f64::INFINITY, |row| row.time_s);
    let Some(pose) = record.truth_at(begin_s) else {
        return errors.rms();
    };
    let mut state = Held {
        time_s: begin_s,
        pose,
        velocity: [0.0; 2],
    };
    let driving = (0..world.steps()).filter(|&step| world.time_s(step) >= begin_s);
    for step in driving {
        let time_s = world.time_s(step);
        while let Some(row) = rows.next_if(|row| row.time_s <= time_s) {
            state.take(row);
        }
        state.hold_until(time_s);
        if let Some(truth) = world.truth(step, robot) {
            errors.add(&state.pose, &truth);
        }
    }
    errors.rms()
}

struct Held {
    time_s: f64,
    pose: Pose,
    velocity: [f64; 2],
}

impl Held {
    fn take(&mut self, row: &OdometryRow) {
        self.hold_until(row.time_s);
        self.velocity = row.velocity;
    }

    fn hold_until(&mut self, time_s: f64) {
        self.pose = arc(&self.pose, self.velocity, (time_s - self.time_s).max(0.0));
        self.time_s = self.time_s.max(time_s);
    }
}

/// Motion at constant velocity: the chord of the arc, at half the turn.
pub(crate) fn arc(pose: &Pose, [v, omega]: [f64; 2], dt_s: f64) -> Pose {
    let half_turn = 0.5 * omega * dt_s;
    let sinc = if half_turn.abs() < 1e-9 {
        1.0
    } else {
        libm::sin(half_turn) / half_turn
    };
    let (sin, cos) = libm::sincos(pose.phi + half_turn);
    let chord = v * dt_s * sinc;
    Pose::new(
        pose.x + chord * cos,
        pose.y + chord * sin,
        pose.phi + omega * dt_s,
    )
}

#[derive(Default)]
struct Errors {
    squares: [f64; 3],
    count: u32,
}

impl Errors {
    fn add(&mut self, estimate: &Pose, truth: &Pose) {
        let error = [
            estimate.x - truth.x,
            estimate.y - truth.y,
            wrap(estimate.phi - truth.phi),
        ];
        self.squares
            .iter_mut()
            .zip(error)
            .for_each(|(sum, error)| *sum += error * error);
        self.count += 1;
    }

    fn rms(&self) -> RmsError {
        let [x_m, y_m, phi_rad] = self
            .squares
            .map(|sum| (sum / f64::from(self.count.max(1))).sqrt());
        RmsError { x_m, y_m, phi_rad }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    #[test]
    fn a_quarter_turn_is_a_quarter_circle() {
        // Radius v/ω = 2 m, a quarter of it in π/2 seconds.
        let end = arc(&Pose::default(), [2.0, 1.0], FRAC_PI_2);
        assert!(
            (end.x - 2.0).abs() < 1e-12
                && (end.y - 2.0).abs() < 1e-12
                && (end.phi - FRAC_PI_2).abs() < 1e-12
        );
        let line = arc(&Pose::new(0.0, 0.0, PI), [1.0, 0.0], 3.0);
        assert!((line.x + 3.0).abs() < 1e-12);
    }
}
