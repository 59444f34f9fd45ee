//! From wheels to the body.

/// What the channels of a decoder are, and how they make a velocity of the body.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Kinematics {
    /// Two wheels of an axle, left and right, that roll without slip: channels `[v_l, v_r]`.
    Axle {
        /// Distance between the wheels \[m\].
        track_m: f64,
    },
    /// The body's own: channels `[v_x, ω]` or `[v_x, ω, v_y]`.
    Body,
}

impl Kinematics {
    /// `[v_x, v_y, ω]` \[m/s, m/s, rad/s\] from the channels' values; what is not there is zero.
    ///
    /// For an axle `v = (v_r + v_l) / 2`, `ω = (v_r − v_l) / track` (Siegwart et al., Introduction to Autonomous
    /// Mobile Robots, 2nd ed., 3.2.2), also for the rear axle of a car, the body's origin lying in its middle.
    pub(super) fn velocity(self, channels: [f64; 3]) -> [f64; 3] {
        let [first, second, third] = channels;
        match self {
            Self::Axle { track_m } => [
                f64::midpoint(first, second),
                0.0,
                (second - first) / track_m,
            ],
            Self::Body => [first, third, second],
        }
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these results are exact")]
mod tests {
    use super::*;

    #[test]
    fn an_axle_drives_straight_turns_left_and_spins() {
        let axle = Kinematics::Axle { track_m: 0.5 };
        assert_eq!(axle.velocity([1.0, 1.0, 0.0]), [1.0, 0.0, 0.0]);
        assert_eq!(axle.velocity([0.75, 1.25, 0.0]), [1.0, 0.0, 1.0]);
        assert_eq!(axle.velocity([-0.25, 0.25, 0.0]), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn a_body_moves_as_it_says() {
        assert_eq!(Kinematics::Body.velocity([1.0, 2.0, 3.0]), [1.0, 3.0, 2.0]);
    }
}
