//! Drives: velocities over time, integrated at 10 kHz.

use std::f64::consts::TAU;

use coloc_estimator::Pose;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::robot::{Robot, WHEEL_BASE_M};

/// How velocities change.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// From interval to interval.
    Stepwise,
    /// All the time, slowly.
    Smooth,
}

/// A drive from the origin.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    pub(crate) interval_s: f64,
    /// The steering angle at the start \[rad\].
    pub(crate) angle_rad: f64,
    pub(crate) intervals: Vec<Interval>,
    pub(crate) end: Pose,
    pub(crate) way_m: f64,
}

/// What happened from one frame to the next.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Interval {
    /// Mean velocity of the body.
    pub(crate) twist: [f64; 3],
    /// How far each wheel rolled \[m\].
    pub(crate) ways: [f64; 4],
    /// The steering angle at its end \[rad\].
    pub(crate) angle_rad: f64,
}

const DURATION_S: u32 = 12;
const INTEGRATOR_HZ: u32 = 10_000;

/// Where velocities wander about, and how far from there \[m/s, m/s, rad/s\]; for cars the last is the angle \[rad\].
const MIDDLE: [f64; 3] = [0.8, 0.1, 0.1];
const WIDTH: [f64; 3] = [0.4, 0.3, 0.3];

/// What is driven at any time.
enum Plan {
    /// In every interval, and the angle at its beginning and end.
    Steps(Vec<([f64; 3], [f64; 2])>),
    /// Sums of swings: amplitude, frequency \[Hz\], phase.
    Swings([[[f64; 3]; 2]; 3]),
}

impl Robot {
    /// The same for the same number.
    pub(crate) fn drive(self, kind: Kind, rate_hz: u32, number: u32) -> Drive {
        let mut random =
            ChaCha8Rng::seed_from_u64(u64::from(number) ^ 0x0D12_13E5 ^ u64::from(rate_hz) << 32);
        let plan = match kind {
            Kind::Stepwise => steps(rate_hz, &mut random),
            Kind::Smooth => swings(&mut random),
        };
        let backwards = random.random_bool(0.3);
        self.integrate(&plan, rate_hz, if backwards { -1.0 } else { 1.0 })
    }

    fn integrate(self, plan: &Plan, rate_hz: u32, direction: f64) -> Drive {
        let (interval_s, steps) = (1.0 / f64::from(rate_hz), INTEGRATOR_HZ / rate_hz);
        let dt_s = interval_s / f64::from(steps);
        let (mut pose, mut way_m, mut intervals) = ([0.0; 3], 0.0, Vec::new());
        for number in 0..rate_hz * DURATION_S {
            let mut interval = Interval {
                twist: [0.0; 3],
                ways: [0.0; 4],
                angle_rad: plan.at(number, 1.0, interval_s).1,
            };
            for step in 0..steps {
                let within = (f64::from(step) + 0.5) / f64::from(steps);
                let (velocity, angle) = plan.at(number, within, interval_s);
                let twist = self.twist(velocity, angle, direction);
                let (sin, cos) = (pose[2] + 0.5 * dt_s * twist[2]).sin_cos();
                let [vx, vy, omega] = twist;
                pose[0] += dt_s * (vx * cos - vy * sin);
                pose[1] += dt_s * (vx * sin + vy * cos);
                pose[2] += dt_s * omega;
                way_m += dt_s * vx.hypot(vy);
                for (way, speed) in interval.ways.iter_mut().zip(self.wheels(twist)) {
                    *way += dt_s * speed;
                }
                for (mean, velocity) in interval.twist.iter_mut().zip(twist) {
                    *mean += velocity / f64::from(steps);
                }
            }
            intervals.push(interval);
        }
        let [x, y, phi] = pose;
        Drive {
            interval_s,
            angle_rad: plan.at(0, 0.0, interval_s).1,
            intervals,
            end: Pose::new(x, y, phi),
            way_m,
        }
    }

    /// What this robot can do of it.
    fn twist(self, [vx, vy, third]: [f64; 3], angle: f64, direction: f64) -> [f64; 3] {
        let vx = direction * vx;
        if self.is_steered() {
            return [vx, 0.0, vx * angle.tan() / WHEEL_BASE_M];
        }
        [vx, if self.moves_sideways() { vy } else { 0.0 }, third]
    }
}

/// Each velocity wanders, with a memory of two seconds.
fn steps(rate_hz: u32, random: &mut ChaCha8Rng) -> Plan {
    let dt_s = 1.0 / f64::from(rate_hz);
    let (keep, width) = (1.0 - dt_s / 2.0, dt_s.sqrt());
    let mut off = [0.0; 3];
    let mut angle: f64 = 0.0;
    let mut made = Vec::new();
    for _ in 0..rate_hz * DURATION_S {
        for (off, sigma) in off.iter_mut().zip(WIDTH) {
            let drawn: f64 = StandardNormal.sample(random);
            *off = *off * keep + sigma * width * drawn;
        }
        let velocity = [0, 1, 2].map(|it: usize| MIDDLE[it] + off[it]);
        // No faster than 0.5 rad/s.
        let next = angle + (off[2].clamp(-0.6, 0.6) - angle).clamp(-0.5 * dt_s, 0.5 * dt_s);
        made.push((velocity, [angle, next]));
        angle = next;
    }
    Plan::Steps(made)
}

/// Periods of twelve seconds and longer.
fn swings(random: &mut ChaCha8Rng) -> Plan {
    let mut swing = |width: f64| {
        [
            random.random_range(0.0..0.5 * width),
            random.random_range(0.02..0.08),
            random.random_range(0.0..TAU),
        ]
    };
    Plan::Swings(WIDTH.map(|width| [swing(width), swing(width)]))
}

impl Plan {
    /// Velocity and steering angle at a part of an interval.
    fn at(&self, interval: u32, within: f64, interval_s: f64) -> ([f64; 3], f64) {
        match self {
            Self::Steps(steps) => {
                let (velocity, [begin, end]) = steps[interval as usize];
                (velocity, begin + within * (end - begin))
            }
            Self::Swings(swings) => {
                let time_s = (f64::from(interval) + within) * interval_s;
                let swing =
                    |[height, hz, phase]: [f64; 3]| height * (TAU * hz * time_s + phase).sin();
                let velocity = [0, 1, 2].map(|it: usize| {
                    let [one, other] = swings[it];
                    MIDDLE[it] + swing(one) + swing(other)
                });
                (velocity, velocity[2])
            }
        }
    }
}
