//! How uncertain the wheels are: variances of an odometry sample as a function of its velocity.

use crate::covariance::{Covariance2, Covariance3};
use crate::motion::Motion;

/// `σ² = a + b v² + c ω² + per_speed |u| + per_turn_rate |ω|`, v in m/s, the speed |u| in m/s whatever its direction, ω in rad/s,
/// per reference period. What is linear makes a variance that grows with the way and with the angle turned, however fast.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Variance {
    /// At standstill.
    pub a: f64,
    /// Per (m/s)².
    pub b: f64,
    /// Per (rad/s)².
    pub c: f64,
    /// Per m/s of speed.
    pub per_speed: f64,
    /// Per rad/s of turning, either way.
    pub per_turn_rate: f64,
}

impl Variance {
    /// σ² at a velocity `v` in the direction that it is of, a `speed` of the robot and a turning rate `omega`
    /// \[m/s, m/s, rad/s\].
    #[must_use]
    #[inline]
    pub fn at(&self, v: f64, speed: f64, omega: f64) -> f64 {
        let squares = self.a + self.b * v * v + self.c * omega * omega;
        squares + self.per_speed * speed + self.per_turn_rate * omega.abs()
    }
}

/// Odometry noise of the forward, sideways and turning velocity.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct OdometryNoise {
    /// Of v (or `v_x`) \[m²/s²\].
    pub forward: Variance,
    /// Of `v_y` \[m²/s²\]; of nonholonomic robots the slip, their `v_y` being zero.
    pub sideways: Variance,
    /// Of ω \[rad²/s²\].
    pub turning: Variance,
}

impl OdometryNoise {
    /// Table 2 of the paper: `σ_v² = 5.075 v²`, `σ_ω² = 0.345`, per sample of 50 Hz.
    #[must_use]
    pub fn paper() -> Self {
        let proportional = Variance {
            b: 5.075,
            ..Variance::default()
        };
        let constant = Variance {
            a: 0.345,
            ..Variance::default()
        };
        Self {
            forward: proportional,
            sideways: proportional,
            turning: constant,
        }
    }

    /// A velocity `[v, ω]` \[m/s, rad/s\] of a robot without sideways velocity, with its noise: also sideways, where it is not zero.
    #[must_use]
    pub fn nonholonomic(&self, velocity: [f64; 2]) -> Motion {
        let [v, omega] = velocity;
        let speed = v.abs();
        let forward = self.forward.at(v, speed, omega);
        let turning = self.turning.at(v, speed, omega);
        let slip = self.sideways.at(0.0, speed, omega);
        if slip > 0.0 {
            return Motion::Holonomic {
                velocity: [v, 0.0, omega],
                noise: Covariance3::clamped_diagonal([forward, slip, turning]),
            };
        }
        let noise = Covariance2::clamped_diagonal([forward, turning]);
        Motion::Nonholonomic { velocity, noise }
    }

    /// A velocity `[v_x, v_y, ω]` \[m/s, m/s, rad/s\] with its noise; each translation's v is its own.
    #[must_use]
    pub fn holonomic(&self, velocity: [f64; 3]) -> Motion {
        let [vx, vy, omega] = velocity;
        let speed = libm::hypot(vx, vy);
        let variances = [
            self.forward.at(vx, speed, omega),
            self.sideways.at(vy, speed, omega),
            self.turning.at(speed, speed, omega),
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

    const VARIANCE: Variance = Variance {
        a: 1.0,
        b: 2.0,
        c: 3.0,
        per_speed: 0.0,
        per_turn_rate: 0.0,
    };

    #[test]
    fn a_variance_grows_with_the_square_of_either_velocity() {
        let at = |v: f64, omega| VARIANCE.at(v, v.abs(), omega).to_bits();
        assert_eq!(at(0.0, 0.0), 1.0_f64.to_bits());
        assert_eq!(at(-3.0, 0.0), 19.0_f64.to_bits());
        assert_eq!(at(0.0, -5.0), 76.0_f64.to_bits());
    }

    #[test]
    fn what_is_of_the_way_does_not_care_how_fast_it_was() {
        let of_the_way = Variance {
            per_speed: 0.5,
            per_turn_rate: 0.25,
            ..Variance::default()
        };
        let driven = |speed: f64| of_the_way.at(speed, speed, -2.0 * speed) / speed;
        assert_eq!([0.1, 1.0, 8.0].map(driven), [1.0; 3]);
    }

    #[test]
    fn a_wheel_slips_sideways_only_if_that_is_said() {
        let mut noise = OdometryNoise::paper();
        let exact = noise.nonholonomic([0.5, 0.2]);
        assert!(matches!(exact, Motion::Nonholonomic { .. }), "{exact:?}");
        noise.sideways = Variance {
            per_speed: 0.01,
            ..VARIANCE
        };
        let Motion::Holonomic { velocity, noise } = noise.nonholonomic([-0.5, 0.0]) else {
            unreachable!("it slips")
        };
        assert_eq!(velocity, [-0.5, 0.0, 0.0]);
        let expected = [5.075 * 0.25, 1.005, 0.345];
        assert_eq!(noise, Covariance3::diagonal(expected).unwrap());
    }
}
