//! What is to be found: how a robot's wheels, gyro and receivers read.

use coloc_estimator::{Covariance3, Increments};

use crate::drive::{State, Way};

/// A robot, as a drive is explained by it.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// How its wheels make its motion.
    pub wheels: Wheels,
    /// Of the way forward, to the side, and of the turn.
    pub noise: [Coefficients; 3],
    /// What every second of standing adds to the variance forward, to the side \[m²/s\] and of the heading \[rad²/s\].
    pub standing: [f64; 3],
    /// What every second without wheels adds to them.
    pub missing: [f64; 3],
    /// If it has one.
    pub gyro: Option<Gyro>,
    /// Those of which fixes came.
    pub receivers: Vec<Receiver>,
    /// Where it looked at the begin of the drive \[rad\].
    pub heading_rad: f64,
}

/// What the wheels read.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Base {
    /// The ways of the left and the right wheel of an axle.
    Axle,
    /// The body's way forward, and its turn.
    Body,
    /// The way of the rear axle, and the angle of the front wheels.
    Steered,
}

/// How readings of the wheels make a way and a turn.
///
/// ```text
/// axle      l = s (1 − δ/2) left, r = s (1 + δ/2) right     way = (l + r)/2     turn = (r − l)/track
/// body      way = s forward                                 turn = s_t turn
/// steered   way = s forward                                 turn = way tan(ratio angle + offset)/wheelbase
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Wheels {
    /// What is read.
    pub base: Base,
    /// s: metres for a metre that was read.
    pub scale: f64,
    /// δ: how much larger the right wheel is than the left one, as a part.
    pub difference: f64,
    /// How far apart the wheels touch the ground, or front from rear axle \[m\].
    pub span_m: f64,
    /// `s_t`: radians for a radian that was read.
    pub turn_scale: f64,
    /// Angle of the front wheels when zero is read \[rad\].
    pub steering_offset_rad: f64,
    /// Radians of the front wheels for a radian that was read.
    pub steering_ratio: f64,
}

/// Of a variance in one direction: what every second, metre and radian add, and what only the square of a velocity does.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Coefficients {
    /// \[m²/s or rad²/s\]
    pub per_s: f64,
    /// \[m²/m or rad²/m\]
    pub per_m: f64,
    /// \[m²/rad or rad²/rad\]
    pub per_rad: f64,
    /// Times v² and ω², for a second.
    pub squares: [f64; 2],
}

/// `ω = scale (reading − bias)`, with white noise.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Gyro {
    /// Radians for a radian that was read.
    pub scale: f64,
    /// What it reads when nothing turns \[rad/s\].
    pub bias_radps: f64,
    /// What every second adds to the variance of the angle \[rad²/s\].
    pub per_s: f64,
}

/// A fix is the antenna's place `delay` before its stamp, a slow error and a new one each time.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Receiver {
    /// What is new in each fix, in each coordinate \[m\].
    pub sigma_m: f64,
    /// What is not: a first-order Gauss–Markov process \[m\].
    pub slow_sigma_m: f64,
    /// How long that lasts \[s\].
    pub slow_time_s: f64,
    /// The antenna in the body frame \[m\].
    pub lever_m: [f64; 2],
    /// How late its stamps are \[s\].
    pub delay_s: f64,
}

/// A way and a turn, and the variances of forward, sideways and turn.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Step {
    pub(crate) held: [f64; 2],
    pub(crate) variances: [f64; 3],
    /// Wheels' turn less the gyro's in what the gyro reads, and its variance.
    pub(crate) parting: Option<[f64; 2]>,
}

impl Wheels {
    /// Two wheels of an axle, calibrated.
    #[must_use]
    pub fn axle(track_m: f64) -> Self {
        Self {
            base: Base::Axle,
            scale: 1.0,
            difference: 0.0,
            span_m: track_m,
            turn_scale: 1.0,
            steering_offset_rad: 0.0,
            steering_ratio: 1.0,
        }
    }

    /// Factors of the left and the right wheel.
    #[must_use]
    pub fn factors(&self) -> [f64; 2] {
        let half = 0.5 * self.difference;
        [self.scale * (1.0 - half), self.scale * (1.0 + half)]
    }

    /// Way and turn \[m, rad\] of what was read.
    #[must_use]
    pub fn held(&self, read: [f64; 2]) -> [f64; 2] {
        match self.base {
            Base::Axle => {
                let [left, right] = self.factors();
                let (left, right) = (left * read[0], right * read[1]);
                [0.5 * (left + right), (right - left) / self.span_m]
            }
            Base::Body => [self.scale * read[0], self.turn_scale * read[1]],
            Base::Steered => {
                let way = self.scale * read[0];
                let angle = self.steering_ratio * read[1] + self.steering_offset_rad;
                [way, way * libm::tan(angle) / self.span_m]
            }
        }
    }
}

impl Coefficients {
    /// Of an interval.
    fn variance(&self, dt_s: f64, [way, turn]: [f64; 2]) -> f64 {
        let squares = (self.squares[0] * way * way + self.squares[1] * turn * turn) / dt_s;
        self.per_s * dt_s + self.per_m * way.abs() + self.per_rad * turn.abs() + squares
    }
}

impl Robot {
    pub(crate) fn step(&self, way: &Way) -> Step {
        let dt_s = way.end_s - way.start_s;
        let of_time = |per_s: [f64; 3]| per_s.map(|it| it * dt_s);
        let mut step = match way.state {
            State::Rolling => {
                let held = self.wheels.held(way.read);
                let variances = self.noise.map(|it| it.variance(dt_s, held));
                Step {
                    held,
                    variances,
                    parting: None,
                }
            }
            State::Standing => Step::still(of_time(self.standing)),
            State::Missing => Step::still(of_time(self.missing)),
        };
        if let (Some(gyro), Some(read)) = (&self.gyro, way.gyro) {
            let turn = gyro.scale * (read - gyro.bias_radps * dt_s);
            step.fuse(turn, gyro.per_s * dt_s, gyro.scale);
        }
        step
    }
}

impl Step {
    fn still(variances: [f64; 3]) -> Self {
        Self {
            held: [0.0; 2],
            variances,
            parting: None,
        }
    }

    /// With what a gyro says of the turn. What parts it from the wheels is told as the gyro has read it: it is the reading that
    /// is likely or not.
    fn fuse(&mut self, turn: f64, variance: f64, scale: f64) {
        let (own, sum) = (self.variances[2], self.variances[2] + variance);
        if sum <= 0.0 {
            return;
        }
        self.parting = Some([(self.held[1] - turn) / scale, sum / (scale * scale)]);
        self.held[1] = (self.held[1] * variance + turn * own) / sum;
        self.variances[2] = own * variance / sum;
    }

    /// A part of it, as if there were no noise.
    pub(crate) fn certain(&self, part: f64) -> Increments {
        let [way, turn] = self.held.map(|it| it * part);
        Increments::arc([way, 0.0, turn], &Covariance3::ZERO)
    }

    /// A part of it, as the estimator takes it.
    pub(crate) fn increments(&self, part: f64) -> Increments {
        let noise = self.variances.map(|it| it * part);
        let noise = Covariance3::diagonal(noise).unwrap_or(Covariance3::ZERO);
        Increments::arc([self.held[0] * part, 0.0, self.held[1] * part], &noise)
    }
}
