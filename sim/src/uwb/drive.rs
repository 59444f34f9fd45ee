//! What both parts have in common: the wheels' noise, and how errors are counted.

use coloc_estimator::angle::wrap;
use coloc_estimator::noise::{OdometryNoise, Variance};
use coloc_estimator::{Belief, FoundSettings, Motion, Pose, Settings, Span, Stamp};
use coloc_uwb::Increment;
use nalgebra::{Matrix3, Vector3};

use super::CHI2_3_95;

/// What every second, metre and radian add to the variances of the way along, across, and of the heading.
pub(super) type Added = [[f64; 3]; 3];

/// The preset `skid-steer`.
pub(super) const SKIDDING: Added = [
    [4e-6, 4.9e-3, 2.5e-3],
    [4e-6, 2.5e-3, 2.5e-3],
    [1.8e-4, 0.0, 1e-2],
];

/// The preset `differential`.
pub(super) const ROLLING: Added = [[4e-6, 4e-4, 1e-4], [4e-6, 1e-4, 1e-4], [4.6e-5, 0.0, 4e-4]];

/// As the estimator takes it.
pub(super) fn noise(added: &Added) -> OdometryNoise {
    let period_s = reference_s();
    let [forward, sideways, turning] = added.map(|[per_s, per_m, per_rad]| Variance {
        a: per_s / period_s,
        per_speed: per_m / period_s,
        per_turn_rate: per_rad / period_s,
        ..Variance::default()
    });
    OdometryNoise {
        forward,
        sideways,
        turning,
    }
}

fn reference_s() -> f64 {
    Settings::default().odometry.reference_period.as_seconds()
}

/// A velocity held for so long, as the radio's filter takes it.
pub(super) fn increment(motion: &Motion, seconds: f64) -> Increment {
    let [v, _, omega] = motion.velocity();
    let half = 0.5 * omega * seconds;
    let way = v * seconds;
    let rates = motion.covariance().variances();
    Increment {
        seconds,
        displacement: Vector3::new(way * half.cos(), way * half.sin(), 2.0 * half),
        covariance: Matrix3::from_diagonal(&(Vector3::from(rates) * reference_s() * seconds)),
    }
}

/// Of a robot that takes part, all others as by default.
pub(super) fn settings() -> Settings {
    Settings {
        found: FoundSettings::default().among_others(),
        ..Settings::default()
    }
}

pub(super) fn stamp(time_s: f64) -> Stamp {
    Stamp::default() + Span::from_seconds(time_s)
}

/// Sums of one robot.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Sums {
    squares: f64,
    turns: f64,
    outside: f64,
    count: f64,
}

impl Sums {
    pub(super) fn push(&mut self, belief: &Belief, truth: &Pose) {
        let Pose { x, y, phi } = belief.pose;
        let error = Vector3::new(x - truth.x, y - truth.y, wrap(phi - truth.phi));
        self.squares += error.xy().norm_squared();
        self.turns += error.z * error.z;
        let nees = belief
            .total()
            .matrix()
            .cholesky()
            .map_or(f64::INFINITY, |root| error.dot(&root.solve(&error)));
        self.outside += f64::from(u8::from(nees > CHI2_3_95));
        self.count += 1.0;
    }

    pub(super) fn plus(self, b: &Self) -> Self {
        Self {
            squares: self.squares + b.squares,
            turns: self.turns + b.turns,
            outside: self.outside + b.outside,
            count: self.count + b.count,
        }
    }

    /// RMS of the position's error \[m\].
    pub(super) fn rms_m(&self) -> f64 {
        (self.squares / self.count).sqrt()
    }

    /// RMS of the heading's \[rad\].
    pub(super) fn rms_rad(&self) -> f64 {
        (self.turns / self.count).sqrt()
    }

    pub(super) fn outside(&self) -> f64 {
        self.outside / self.count
    }
}
