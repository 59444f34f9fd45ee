//! How uncertain the wheels are: variances of an odometry sample as a function of its velocity.

use crate::covariance::{Covariance2, Covariance3};
use crate::motion::Motion;

/// `σ² = a + b v² + c ω²`, v in m/s, ω in rad/s, per reference period.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Variance {
    /// At standstill.
    pub a: f64,
    /// Per (m/s)².
    pub b: f64,
    /// Per (rad/s)².
    pub c: f64,
}

impl Variance {
    /// σ² at a forward velocity (or speed) `v` \[m/s\] and a turning rate `omega` \[rad/s\].
    #[must_use]
    pub fn at(&self, v: f64, omega: f64) -> f64 {
        self.a + self.b * v * v + self.c * omega * omega
    }
}

/// Odometry noise of the forward, sideways and turning velocity.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct OdometryNoise {
    /// Of v (or `v_x`) \[m²/s²\].
    pub forward: Variance,
    /// Of `v_y` \[m²/s²\]; unused by nonholonomic robots.
    pub sideways: Variance,
    /// Of ω \[rad²/s²\].
    pub turning: Variance,
}

impl OdometryNoise {
    /// Table 2 of the paper: `σ_v² = 5.075 v²`, `σ_ω² = 0.345`, per sample of 50 Hz.
    #[must_use]
    pub fn paper() -> Self {
        let proportional = Variance {
            a: 0.0,
            b: 5.075,
            c: 0.0,
        };
        let constant = Variance {
            a: 0.345,
            b: 0.0,
            c: 0.0,
        };
        Self {
            forward: proportional,
            sideways: proportional,
            turning: constant,
        }
    }

    /// A velocity `[v, ω]` \[m/s, rad/s\] of a robot without sideways velocity, with its noise.
    #[must_use]
    pub fn nonholonomic(&self, velocity: [f64; 2]) -> Motion {
        let [v, omega] = velocity;
        let noise =
            Covariance2::clamped_diagonal([self.forward.at(v, omega), self.turning.at(v, omega)]);
        Motion::Nonholonomic { velocity, noise }
    }

    /// A velocity `[v_x, v_y, ω]` \[m/s, m/s, rad/s\] with its noise; each translation's v is its own.
    #[must_use]
    pub fn holonomic(&self, velocity: [f64; 3]) -> Motion {
        let [vx, vy, omega] = velocity;
        let speed = libm::hypot(vx, vy);
        let variances = [
            self.forward.at(vx, omega),
            self.sideways.at(vy, omega),
            self.turning.at(speed, omega),
        ];
        Motion::Holonomic {
            velocity,
            noise: Covariance3::clamped_diagonal(variances),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variance_grows_with_the_square_of_either_velocity() {
        let variance = Variance {
            a: 1.0,
            b: 2.0,
            c: 3.0,
        };
        let at = |v, omega| variance.at(v, omega).to_bits();
        assert_eq!(at(0.0, 0.0), 1.0_f64.to_bits());
        assert_eq!(at(-3.0, 0.0), 19.0_f64.to_bits());
        assert_eq!(at(0.0, -5.0), 76.0_f64.to_bits());
    }
}
