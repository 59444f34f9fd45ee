//! What a robot really does, and what its wheels and its gyro say of it.

use coloc_estimator::angle::wrap;
use coloc_estimator::noise::{OdometryNoise, Variance};
use coloc_estimator::{
    GyroSample, GyroSettings, Measurement, Motion, OdometrySample, Origin, Pose, Stamp,
};

use super::{Row, Wheels};
use crate::honest::increment::{Increment, Place};
use crate::random::{Draws, Noise, Purpose};

pub(super) const RATE_HZ: u32 = 50;
const PERIOD_NS: i64 = 20_000_000;
const DT_S: f64 = 0.02;

/// Samples of the gyro in a tick.
const PARTS: u8 = 4;

/// What stays the same for so long: how a robot turns \[s\].
const STRETCH_S: u32 = 5;
const FASTEST: f64 = 0.5;

/// Beyond this of where they started, robots of a team turn back \[m\].
const FLOOR_M: f64 = 10.0;

/// σ of the scale's error.
const SCALE: f64 = 0.001;

/// The largest bias at the start \[rad/s\].
const LARGEST_BIAS: f64 = 0.05;

const LOST: f64 = 0.01;
const DOUBLED: f64 = 0.01;

/// 0.95° in an hour, of a robot that stands.
const CREEP: f64 = 0.0166 * 0.0166 / 3600.0;

/// One robot and its sensors.
pub(super) struct World {
    row: Row,
    pub(super) place: Place,
    pub(super) bias: f64,
    scale: f64,
    turns: Draws,
    way: Draws,
    gyro: Draws,
    losses: Draws,
    rate: f64,
    sequence: u64,
}

/// How the robot moves in a tick, and what is wrong with its wheels.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Doing {
    pub(super) stands: bool,
    pub(super) slips: bool,
    silent: bool,
}

pub(super) fn stamp(tick: u32) -> Stamp {
    Stamp::from_nanos(i64::from(tick) * PERIOD_NS)
}

pub(super) fn settings() -> GyroSettings {
    GyroSettings::ORDINARY
}

fn noise() -> OdometryNoise {
    let of_the_way = |per_speed: f64, per_turn_rate: f64| Variance {
        per_speed: per_speed / DT_S,
        per_turn_rate: per_turn_rate / DT_S,
        ..Variance::default()
    };
    OdometryNoise {
        forward: of_the_way(0.02 * 0.02, 0.0),
        sideways: of_the_way(0.005 * 0.005, 0.0),
        turning: of_the_way(3.0_f64.to_radians().powi(2) / 60.0, 0.02 * 0.02),
    }
}

impl Doing {
    pub(super) fn at(row: &Row, tick: u32) -> Self {
        let second = tick / RATE_HZ;
        let driven = second.checked_sub(row.stands_first_s);
        let stands = driven.is_none_or(|it| row.stops && it % 45 >= 40);
        Self {
            stands,
            slips: row.wheels == Wheels::Slip && !stands && (25..30).contains(&(second % 60)),
            silent: row.wheels == Wheels::FallSilent && (70..75).contains(&(second % 100)),
        }
    }
}

impl World {
    pub(super) fn new(row: &Row, noise: &Noise, robot: usize) -> Self {
        let mut gyro = noise.draws(Purpose::Gyro, 0, robot, 0);
        Self {
            row: *row,
            place: Place::default(),
            bias: gyro.uniform(-LARGEST_BIAS, LARGEST_BIAS),
            scale: 1.0 + SCALE * gyro.normal(),
            turns: noise.draws(Purpose::Turns, 0, robot, 0),
            way: noise.draws(Purpose::TrueWay, 0, robot, 0),
            gyro,
            losses: noise.draws(Purpose::GyroLoss, 0, robot, 0),
            rate: 0.0,
            sequence: 0,
        }
    }

    /// The tick passes; what is measured in it is put where the robot hears it.
    pub(super) fn tick(&mut self, tick: u32, heard: &mut Vec<Measurement>) {
        let doing = Doing::at(&self.row, tick);
        if tick.is_multiple_of(STRETCH_S * RATE_HZ) || tick == 1 {
            self.rate = self.turns.uniform(-FASTEST, FASTEST);
        }
        let velocity = if doing.stands {
            [0.0; 2]
        } else {
            [1.0, self.steered()]
        };
        let motion = reported(velocity, doing);
        let truth = noise().nonholonomic(velocity);
        let variances = if doing.stands {
            [0.0; 3]
        } else {
            truth.covariance().variances()
        };
        let share = 1.0 / f64::from(PARTS);
        let held = truth.velocity().map(|it| it * DT_S * share);
        let increment = Increment::new(held, variances.map(|it| it * DT_S * DT_S * share));
        for part in 1..=PARTS {
            let before = self.place.heading;
            increment.drive(&mut self.place, &mut self.way);
            self.read(tick, part, self.place.heading - before, heard);
        }
        if !doing.silent {
            heard.push(Measurement::Odometry(OdometrySample {
                source: 0,
                start: stamp(tick - 1),
                stamp: stamp(tick),
                motion,
            }));
        }
    }

    fn steered(&self) -> f64 {
        let [x, y] = self.place.position;
        if !self.row.team || x.hypot(y) < FLOOR_M {
            return self.rate;
        }
        let back = wrap((-y).atan2(-x) - self.place.heading);
        back.clamp(-FASTEST, FASTEST)
    }

    fn read(&mut self, tick: u32, part: u8, turn: f64, heard: &mut Vec<Measurement>) {
        let settings = settings();
        let dt_s = DT_S / f64::from(PARTS);
        self.bias += (settings.bias_walk * dt_s).sqrt() * self.gyro.normal();
        let noise = (settings.noise / dt_s).sqrt() * self.gyro.normal();
        self.sequence += 1;
        if self.losses.happens(LOST) {
            return;
        }
        let sample = Measurement::Gyro(GyroSample {
            stamp: Stamp::from_nanos(
                stamp(tick - 1).as_nanos() + i64::from(part) * PERIOD_NS / i64::from(PARTS),
            ),
            origin: Origin::counted(self.sequence),
            rate_radps: self.scale * turn / dt_s + self.bias + noise,
            noise: 0.0,
        });
        heard.push(sample);
        if self.losses.happens(DOUBLED) {
            heard.push(sample);
        }
    }

    pub(super) fn pose(&self) -> Pose {
        let [x, y] = self.place.position;
        Pose::new(x, y, self.place.heading)
    }
}

fn reported([v, turn]: [f64; 2], doing: Doing) -> Motion {
    if doing.stands {
        return Motion::standstill([1e-9, 1e-9, CREEP / DT_S]);
    }
    let velocity = if doing.slips {
        [1.3 * v, turn + 0.4]
    } else {
        [v, turn]
    };
    noise().nonholonomic(velocity)
}
