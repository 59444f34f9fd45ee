//! Where a robot really is.

use std::f64::consts::PI;

use coloc_estimator::noise::{OdometryNoise, Variance};
use coloc_estimator::{Motion, Pose, angle::wrap};

use super::TICKS;
use super::field::Field;
use crate::random::{Draws, Noise, Purpose};

pub(super) const TICK_S: f64 = 0.02;
#[allow(clippy::cast_precision_loss)] // Five.
const EXCHANGE_S: f64 = TICK_S * TICKS as f64;

const TOP_SPEED_MPS: f64 = 1.0;
const TOP_TURN_RADPS: f64 = 1.0;
/// Of the speed, per metre to the goal.
const SPEED_GAIN_PER_S: f64 = 0.8;
const TURN_GAIN_PER_S: f64 = 1.5;
const ACCELERATION_MPS2: f64 = 1.0;
const TURN_ACCELERATION_RADPS2: f64 = 4.0;
const GOAL_SPEED_MPS: f64 = 0.8;
/// The goal turns at another rate after so many exchanges, at most this fast.
const STRETCH: u32 = 50;
const GOAL_TURN_RADPS: f64 = 0.4;

/// A robot that chases a goal. The goal wanders smoothly and is thrown back at the edges, so that it is everywhere on the field
/// equally often. The robot sees where it is, and is steered at each exchange.
pub(super) struct Driver {
    goal: Goal,
    slip: Draws,
    pose: Pose,
    /// `[v, ω]` \[m/s, rad/s\], as it is meant.
    velocity: [f64; 2],
}

struct Goal {
    /// From the middle of the field to its edges \[m\].
    reach_m: f64,
    place: [f64; 2],
    heading: f64,
    turn_radps: f64,
    /// Exchanges until it turns at another rate.
    left: u32,
    draws: Draws,
}

impl Goal {
    fn new(number: usize, field: Field, noise: &Noise) -> Self {
        let reach_m = field.side_m / 2.0;
        let mut draws = noise.draws(Purpose::Waypoint, 0, number, 0);
        Self {
            reach_m,
            place: [0; 2].map(|_| draws.uniform(-reach_m, reach_m)),
            heading: draws.uniform(-PI, PI),
            turn_radps: 0.0,
            left: 0,
            draws,
        }
    }

    fn wander(&mut self) {
        if self.left == 0 {
            self.left = STRETCH;
            self.turn_radps = self.draws.uniform(-GOAL_TURN_RADPS, GOAL_TURN_RADPS);
        }
        self.left -= 1;
        self.heading = wrap(self.heading + self.turn_radps * EXCHANGE_S);
        let (sin, cos) = libm::sincos(self.heading);
        let way_m = GOAL_SPEED_MPS * EXCHANGE_S;
        self.place[0] += way_m * cos;
        self.place[1] += way_m * sin;
        if self.place[0].abs() > self.reach_m {
            self.place[0] = mirrored(self.place[0], self.reach_m);
            self.heading = wrap(PI - self.heading);
        }
        if self.place[1].abs() > self.reach_m {
            self.place[1] = mirrored(self.place[1], self.reach_m);
            self.heading = -self.heading;
        }
    }
}

impl Driver {
    /// At its goal.
    pub(super) fn new(number: usize, field: Field, noise: &Noise) -> Self {
        let goal = Goal::new(number, field, noise);
        Self {
            pose: Pose::new(goal.place[0], goal.place[1], goal.heading),
            goal,
            slip: noise.draws(Purpose::TrueWay, 0, number, 0),
            velocity: [0.0; 2],
        }
    }

    pub(super) fn pose(&self) -> Pose {
        self.pose
    }

    /// Drives to the next exchange; what the wheels say of each tick until then.
    pub(super) fn drive(&mut self, noise: &OdometryNoise) -> Motion {
        self.steer();
        let [v, omega] = self.velocity;
        let sigma = [
            noise.forward.at(v, v.abs(), omega),
            noise.sideways.at(0.0, v.abs(), omega),
            noise.turning.at(v, v.abs(), omega),
        ]
        .map(f64::sqrt);
        for _ in 0..TICKS {
            self.advance(sigma);
        }
        noise.nonholonomic(self.velocity)
    }

    fn steer(&mut self) {
        self.goal.wander();
        let [x, y] = self.goal.place;
        let [dx, dy] = [x - self.pose.x, y - self.pose.y];
        let speed_mps = (SPEED_GAIN_PER_S * (dx * dx + dy * dy).sqrt()).min(TOP_SPEED_MPS);
        let error = wrap(libm::atan2(dy, dx) - self.pose.phi);
        let wanted = [
            speed_mps * libm::cos(error).max(0.0),
            (TURN_GAIN_PER_S * error).clamp(-TOP_TURN_RADPS, TOP_TURN_RADPS),
        ];
        let most = [ACCELERATION_MPS2, TURN_ACCELERATION_RADPS2].map(|it| it * EXCHANGE_S);
        for ((velocity, wanted), most) in self.velocity.iter_mut().zip(wanted).zip(most) {
            *velocity += (wanted - *velocity).clamp(-most, most);
        }
    }

    /// A tick along an arc that slips.
    fn advance(&mut self, sigma: [f64; 3]) {
        let slip: [f64; 3] = self.slip.normals();
        let ahead_m = TICK_S * (self.velocity[0] + sigma[0] * slip[0]);
        let aside_m = TICK_S * sigma[1] * slip[1];
        let half_turn = 0.5 * TICK_S * (self.velocity[1] + sigma[2] * slip[2]);
        // sin(x)/x, to 1e-10 for turns of some degrees.
        let chord_m = ahead_m * (1.0 - half_turn * half_turn / 6.0);
        let (sin, cos) = libm::sincos(self.pose.phi + half_turn);
        self.pose = Pose::new(
            self.pose.x + chord_m * cos - aside_m * sin,
            self.pose.y + chord_m * sin + aside_m * cos,
            self.pose.phi + 2.0 * half_turn,
        );
    }
}

/// Thrown back at the edge that it is beyond.
fn mirrored(along_m: f64, reach_m: f64) -> f64 {
    along_m.signum() * (2.0 * reach_m - along_m.abs())
}

/// Two wheels on a hard floor, as `colocd` takes them by default: 2 cm after a metre, 3° after a minute.
pub(super) fn wheels() -> OdometryNoise {
    let added = |per_s: f64, per_m: f64, per_rad: f64| Variance {
        a: per_s / TICK_S,
        per_speed: per_m / TICK_S,
        per_turn_rate: per_rad / TICK_S,
        ..Variance::default()
    };
    OdometryNoise {
        forward: added(4e-6, 4e-4, 1e-4),
        sideways: added(4e-6, 1e-4, 1e-4),
        turning: added(4.6e-5, 0.0, 4e-4),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn driver(number: usize) -> Driver {
        Driver::new(number, Field { side_m: 60.0 }, &Noise::new(1, 0))
    }

    #[test]
    fn robots_drive_smoothly_and_stay_on_the_field() {
        for number in 0..5 {
            let mut driver = driver(number);
            let mut way_m = 0.0;
            for _ in 0..6000 {
                let before = driver.velocity;
                driver.drive(&wheels());
                way_m += driver.velocity[0] * EXCHANGE_S;
                let [v, omega] = driver.velocity;
                assert!((v - before[0]).abs() < 0.101 && (omega - before[1]).abs() < 0.401);
                assert!(driver.pose.x.abs() < 30.5 && driver.pose.y.abs() < 30.5);
            }
            assert!(way_m > 400.0, "{way_m}");
        }
    }

    #[test]
    fn all_of_the_field_is_driven_on_alike() {
        let mut quarters = [0_u32; 4];
        for number in 0..40 {
            let mut driver = driver(number);
            for _ in 0..6000 {
                driver.drive(&wheels());
                let far = driver.pose.x.abs().max(driver.pose.y.abs());
                let edge = [15.0, 21.2, 26.0].iter().filter(|&&it| far > it).count();
                quarters[edge] += 1;
            }
        }
        // Squares around one another, of a quarter of the area each.
        let shares = quarters.map(|count| f64::from(count) / 240_000.0);
        assert!(
            shares.iter().all(|share| (0.18..0.32).contains(share)),
            "{shares:?}"
        );
    }

    #[test]
    fn the_truth_is_off_by_what_the_noise_says() {
        let (mut driver, noise) = (driver(0), wheels());
        let (mut sum, mut expected) = (0.0, 0.0);
        for _ in 0..20_000 {
            let before = driver.pose.phi;
            driver.drive(&noise);
            let [v, omega] = driver.velocity;
            let slip = wrap(driver.pose.phi - before - omega * EXCHANGE_S);
            sum += slip * slip;
            expected += noise.turning.at(v, v.abs(), omega) * TICK_S * EXCHANGE_S;
        }
        assert!((sum / expected - 1.0).abs() < 0.05, "{sum} {expected}");
    }

    #[test]
    fn what_leaves_at_an_edge_comes_back_from_it() {
        let off = |along_m: f64, there_m: f64| (mirrored(along_m, 10.0) - there_m).abs();
        assert!(off(11.0, 9.0) < 1e-12 && off(-12.0, -8.0) < 1e-12);
    }
}
