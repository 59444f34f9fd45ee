//! Algorithm 1: propagation of the belief through the motion model \[8–17\].

use crate::belief::Belief;
use crate::compose::{Dimension, Displacement, compose};
use crate::covariance::{Covariance2, Covariance3};
use crate::honest::{Swept, chord_of, step};
use crate::pose::Pose;
use crate::settings::Propagation;
use crate::symmetric::Symmetric3;

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

    /// Q of `[v_x, v_y, ω]`.
    #[must_use]
    pub fn covariance(&self) -> Covariance3 {
        Covariance3::trusted(&self.noise())
    }

    /// The same velocity with noise `Q + more`, over `[v_x, v_y, ω]`.
    #[must_use]
    pub fn with_noise_added(&self, more: &Covariance3) -> Self {
        Self::Holonomic {
            velocity: self.velocity(),
            noise: self.covariance().plus(more),
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

/// Algorithm 1: the belief after `dt_s` seconds of `motion`, \[11–17\] or as [`crate::honest`] has it; `dt_s` is finite and not
/// negative.
///
/// Where no time passes, nothing changes, to the last bit.
#[must_use]
#[inline]
pub fn propagate(belief: &Belief, motion: &Motion, dt_s: f64, propagation: Propagation) -> Belief {
    if dt_s == 0.0 {
        return *belief;
    }
    match propagation {
        Propagation::Honest => step(belief, &motion.swept(belief.pose.phi, dt_s)).belief,
        Propagation::Paper => compose(belief, &motion.over(dt_s)),
    }
}

/// `pose` after the arc of `held = [d_x, d_y, Δ]`, for whoever knows its heading.
#[inline]
pub(crate) fn drive(pose: Pose, held: [f64; 3]) -> Pose {
    let [_, _, turn] = held;
    let way = chord_of(pose.phi, held);
    Pose::new(pose.x + way.x, pose.y + way.y, pose.phi + turn)
}

impl Motion {
    /// The arc of `dt_s` seconds, from the heading `phi`.
    #[inline]
    pub(crate) fn swept(&self, phi: f64, dt_s: f64) -> Swept {
        let (held, noise) = self.held_over(dt_s);
        Swept::arc(phi, held, &noise)
    }

    /// [`Self::swept`] from the heading zero, and sine and cosine of half the turn.
    #[inline]
    pub(crate) fn swept_with_half(&self, dt_s: f64) -> (Swept, [f64; 2]) {
        let held = self.velocity().map(|u| dt_s * u);
        let (sin, cos) = libm::sincos(0.5 * held[2]);
        let noise = self.noise() * (dt_s * dt_s);
        (Swept::arc_along([sin, cos], held, &noise), [sin, cos])
    }

    /// `δt ū` with the covariance `δt² Q` of its noise.
    #[inline]
    pub(crate) fn held_over(&self, dt_s: f64) -> ([f64; 3], Symmetric3) {
        let held = self.velocity().map(|u| dt_s * u);
        (held, self.noise() * (dt_s * dt_s))
    }

    /// The same for the cubature transform.
    #[inline]
    fn over(&self, dt_s: f64) -> Displacement {
        let dimension = match self {
            Self::Nonholonomic { .. } => &Dimension::FIVE,
            Self::Holonomic { .. } => &Dimension::SIX,
        };
        let (mean, noise) = self.held_over(dt_s);
        Displacement {
            mean,
            noise,
            dimension,
        }
    }

    /// Q of `[v_x, v_y, ω]`.
    #[inline]
    fn noise(&self) -> Symmetric3 {
        match self {
            Self::Nonholonomic { noise, .. } => without_sideways(noise),
            Self::Holonomic { noise, .. } => noise.symmetric(),
        }
    }
}

/// Q of `[v, ω]` as that of `[v_x, v_y, ω]`.
#[inline]
fn without_sideways(noise: &Covariance2) -> Symmetric3 {
    let q = noise.matrix();
    Symmetric3 {
        xx: q.m11,
        xp: q.m21,
        pp: q.m22,
        ..Symmetric3::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::honest::{Bend, Increments};
    use crate::parts::Parts;

    const Q: [f64; 4] = [0.04, 0.002, 0.002, 0.01];

    fn motion() -> Motion {
        Motion::Nonholonomic {
            velocity: [0.5, 0.2],
            noise: Covariance2::from_row_major(Q).unwrap(),
        }
    }

    #[test]
    fn no_time_changes_nothing() {
        let covariance =
            Covariance3::from_row_major([0.1, 0.03, 0.0, 0.03, 0.1, 0.01, 0.0, 0.01, 0.3]).unwrap();
        let belief = Belief::independent(Pose::new(1.0, 2.0, 3.0), covariance);
        assert_eq!(
            propagate(&belief, &motion(), 0.0, Propagation::Honest),
            belief
        );
    }

    #[test]
    fn from_certainty_only_the_noise_remains() {
        let moved = |it| propagate(&Belief::default(), &motion(), 2.0, it);
        let paper = moved(Propagation::Paper);
        assert_eq!(paper.pose, Pose::new(1.0, 0.0, 0.4));
        assert_eq!(paper.parts.dependent, Covariance3::ZERO);
        let noise =
            Covariance3::from_row_major([0.16, 0.0, 0.008, 0.0, 0.0, 0.0, 0.008, 0.0, 0.04])
                .unwrap();
        assert!((paper.total().matrix() - noise.matrix()).abs().max() < 1e-17);
        let arc = Increments::arc([1.0, 0.0, 0.4], &noise);
        let honest = moved(Propagation::Honest);
        let [x, y] = arc.translation;
        assert_eq!(honest.pose, Pose::new(x, y, 0.4));
        assert_eq!(honest.parts, Parts::independent(arc.noise));
        assert_eq!(honest.bend, Bend::ZERO);
    }

    #[test]
    fn standing_still_has_no_velocity_and_keeps_its_noise() {
        let still = Motion::standstill([1.0, 2.0, -3.0]);
        assert_eq!(still.velocity(), [0.0; 3]);
        let Motion::Holonomic { noise, .. } = still.with_noise_scaled(0.5) else {
            unreachable!()
        };
        assert_eq!(noise, Covariance3::diagonal([0.5, 1.0, 0.0]).unwrap());
    }
}
