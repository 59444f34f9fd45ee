//! From wheels to the body.

use super::bicycle::Bicycle;
use super::channel::Part;
use super::least_squares::LeastSquares;
use super::merge::MAX_CHANNELS;

/// What the channels of a decoder are, and how they make a velocity of the body.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Kinematics {
    /// Two wheels of an axle, left and right, that roll without slip: channels `[v_l, v_r]`.
    Axle {
        /// Distance between the wheels \[m\].
        track_m: f64,
        /// So much of the turn that they say is made.
        turning_scale: f64,
    },
    /// A steered car: channels `[v, δ]`.
    Bicycle(Bicycle),
    /// Wheels of which each says a part of the motion: channels are their speeds.
    LeastSquares(LeastSquares),
    /// The body's own: channels `[v_x, ω]` or `[v_x, ω, v_y]`.
    Body,
}

/// A velocity of the body, and what the kinematics know of its noise.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Twist {
    /// `[v_x, v_y, ω]` \[m/s, m/s, rad/s\].
    pub(super) velocity: [f64; 3],
    /// Covariance of its mean over the interval.
    pub(super) spread: Spread,
}

/// A symmetric matrix over `[v_x, v_y, ω]`.
pub(super) type Spread = [[f64; 3]; 3];

/// No noise.
pub(super) const NO_SPREAD: Spread = [[0.0; 3]; 3];

/// Adds `factor · a aᵀ`.
pub(super) fn add_outer(spread: &mut Spread, a: [f64; 3], factor: f64) {
    for (row, x) in spread.iter_mut().zip(a) {
        for (entry, y) in row.iter_mut().zip(a) {
            *entry += factor * x * y;
        }
    }
}

impl Kinematics {
    /// What the channels' values of an interval of `dt_s` seconds make; what is not there is zero.
    ///
    /// For an axle `v = (v_r + v_l) / 2`, `ω = (v_r − v_l) / track` (Siegwart et al., Introduction to Autonomous
    /// Mobile Robots, 2nd ed., 3.2.2), also for the rear axle of a car, the body's origin lying in its middle. Wheels or tracks
    /// that skid turn about centres that lie outside of them, as if the track were `track / scale` (Mandow et al.,
    /// Experimental kinematics for wheeled skid-steer mobile robots, IROS 2007, whose steering efficiency χ is `1 / scale`).
    pub(super) fn twist(&self, channels: &[Part; MAX_CHANNELS], dt_s: f64) -> Twist {
        let speeds = channels.map(|it| it.value);
        let [first, second, third, _] = speeds;
        let exact = |velocity| Twist {
            velocity,
            spread: NO_SPREAD,
        };
        match self {
            Self::Axle {
                track_m,
                turning_scale,
            } => exact([
                f64::midpoint(first, second),
                0.0,
                (second - first) / track_m * turning_scale,
            ]),
            Self::Bicycle(bicycle) => {
                let [speed, steering, ..] = channels;
                let Part {
                    before,
                    value,
                    bend,
                } = steering;
                bicycle.twist(speed.value, [*before, *value], *bend, dt_s)
            }
            Self::LeastSquares(it) => it.twist(speeds, dt_s),
            Self::Body => exact([first, third, second]),
        }
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these results are exact")]
mod tests {
    use super::*;

    fn velocity(kinematics: Kinematics, values: [f64; 3]) -> [f64; 3] {
        let [first, second, third] = values.map(|value| Part {
            value,
            before: value,
            bend: 0.0,
        });
        let channels = [first, second, third, Part::default()];
        kinematics.twist(&channels, 0.02).velocity
    }

    #[test]
    fn an_axle_drives_straight_turns_left_and_spins() {
        let axle = Kinematics::Axle {
            track_m: 0.5,
            turning_scale: 1.0,
        };
        assert_eq!(velocity(axle, [1.0, 1.0, 0.0]), [1.0, 0.0, 0.0]);
        assert_eq!(velocity(axle, [0.75, 1.25, 0.0]), [1.0, 0.0, 1.0]);
        assert_eq!(velocity(axle, [-0.25, 0.25, 0.0]), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn a_part_of_the_turn_is_made_where_wheels_skid() {
        let skid = Kinematics::Axle {
            track_m: 0.5,
            turning_scale: 0.5,
        };
        assert_eq!(velocity(skid, [0.75, 1.25, 0.0]), [1.0, 0.0, 0.5]);
    }

    #[test]
    fn a_body_moves_as_it_says() {
        assert_eq!(velocity(Kinematics::Body, [1.0, 2.0, 3.0]), [1.0, 3.0, 2.0]);
    }
}
