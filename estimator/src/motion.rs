//! Algorithm 1: propagation of the belief through the motion model \[8–17\].

use crate::belief::Belief;
use crate::covariance::{Covariance2, Covariance3};

/// A velocity and the covariance of its noise, for the two kinds of drive \[1\].
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Motion {
    /// No sideways velocity: `[v, ω]` \[m/s, rad/s\].
    Nonholonomic {
        /// `[v, ω]`
        velocity: [f64; 2],
        /// Q \[m²/s², m·rad/s², rad²/s²\]
        noise: Covariance2,
    },
    /// `[v_x, v_y, ω]` \[m/s, m/s, rad/s\].
    Holonomic {
        /// `[v_x, v_y, ω]`
        velocity: [f64; 3],
        /// Q \[m²/s², m·rad/s², rad²/s²\]
        noise: Covariance3,
    },
}

impl Motion {
    /// Standing still, with independent noise of the given variances `[v_x, v_y, ω]` \[m²/s², m²/s², rad²/s²\];
    /// one that is not a positive finite number counts as zero.
    #[must_use]
    pub fn standstill(variance: [f64; 3]) -> Self {
        Self::Holonomic {
            velocity: [0.0; 3],
            noise: Covariance3::clamped_diagonal(variance),
        }
    }

    /// `[v_x, v_y, ω]` in the body frame \[m/s, m/s, rad/s\].
    #[must_use]
    pub fn velocity(&self) -> [f64; 3] {
        match *self {
            Self::Nonholonomic {
                velocity: [v, omega],
                ..
            } => [v, 0.0, omega],
            Self::Holonomic { velocity, .. } => velocity,
        }
    }

    /// The same velocity with noise `factor · Q`; a factor that is not a positive finite number counts as zero.
    #[must_use]
    pub fn with_noise_scaled(&self, factor: f64) -> Self {
        match *self {
            Self::Nonholonomic { velocity, noise } => Self::Nonholonomic {
                velocity,
                noise: noise.scaled(factor),
            },
            Self::Holonomic { velocity, noise } => Self::Holonomic {
                velocity,
                noise: noise.scaled(factor),
            },
        }
    }
}

/// Algorithm 1: the belief after `dt_s` seconds of `motion`.
#[must_use]
pub fn propagate(belief: &Belief, motion: &Motion, dt_s: f64) -> Belief {
    let _ = (belief, motion, dt_s);
    unimplemented!()
}
