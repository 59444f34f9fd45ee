//! What a robot believes.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::Matrix;
use crate::{BeliefState, Health, Input, Limits, Opinion, Reject, Unfit, WhyUnfit, worst_sigmas};

/// `coloc/<robot>/estimate`: the belief of every tick, and whether to drive on it; a late joiner gets the last one.
/// Where the daemon's time went is on [`Timing`](super::Timing).
///
/// The covariance comes in two parts, so that none of them can lose its sign on the way; the whole is [`Self::total`].
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Estimate.v5")]
pub struct Estimate {
    /// The moment that the pose is of, by the configured clock; `source` is the robot's team number.
    pub header: Header,
    /// The same moment by `CLOCK_BOOTTIME` of the robot's computer (ns): it never steps, so ages are best counted by it.
    pub boot_ns: i64,
    /// Ticks since the daemon started.
    pub tick: u64,
    /// `[x, y, φ]` in the common frame (m, m, rad).
    pub pose: [f64; 3],
    /// `[x, y, φ]` in the odometry frame (m, m, rad): where the wheels alone have taken the robot since its daemon started. It
    /// drifts without end, and no measurement moves it: it jumps only by what a late frame of the wheels corrects. `pose` jumps when
    /// the robot learns. For controllers, and for differences of two poses.
    pub odometry: [f64; 3],
    /// `[v_x, v_y, ω]` in the body frame (m/s, m/s, rad/s).
    pub velocity: [f64; 3],
    /// `P_i`, the part that is independent of everything else, 3×3, full row-major (m², m·rad, rad²).
    pub independent: [f64; 9],
    /// `P_d`, the part that may depend on other robots' beliefs, likewise.
    pub dependent: [f64; 9],
    /// Covariance of `velocity`, its mean over the configured reference period, 3×3, full row-major (m²/s², m·rad/s²,
    /// rad²/s²). A robot that cannot move sideways has a variance of zero there.
    pub velocity_covariance: [f64; 9],
    /// What the gyro reads when nothing turns, as far as it is known; 0 where there is no gyro (rad/s).
    pub gyro_bias_radps: f64,
    /// Its standard deviation; 0 where there is no gyro (rad/s).
    pub gyro_bias_sigma_radps: f64,
    /// [`Health`] by [`Input`], one byte each; read it with [`Self::health_of`]. Those without a name are zero.
    pub health: [u8; Input::PLACES],
    /// [`BeliefState`]; read it with [`Self::state`].
    pub state: u8,
    /// 1: fit to drive on; read it with [`Self::is_fit`].
    pub fit: u8,
    /// [`Unfit`]; read it with [`Self::why_unfit`]. 0 where it is fit.
    pub unfit: u8,
    /// [`Opinion`]; read it with [`Self::opinion`]. Zero where none is asked for.
    pub opinion: u8,
    /// What is exceeded: the largest σ that is configured for the position (m) or the heading (rad), by `unfit`; else 0.
    pub fit_limit: f32,
}

layout!(Estimate, 384;
    header: 0, boot_ns: 40, tick: 48, pose: 56, odometry: 80, velocity: 104, independent: 128, dependent: 200,
    velocity_covariance: 272, gyro_bias_radps: 344, gyro_bias_sigma_radps: 352, health: 360, state: 376, fit: 377, unfit: 378,
    opinion: 379, fit_limit: 380,
);

impl Estimate {
    /// Checks what a reader needs: finite, all covariances valid, of the team, of the time.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Limits::check_finite(&self.odometry)?;
        Limits::check_finite(&self.velocity)?;
        Limits::check_finite(&[self.gyro_bias_radps, self.gyro_bias_sigma_radps])?;
        let [independent, dependent, velocity] =
            [self.independent, self.dependent, self.velocity_covariance]
                .map(Matrix::<3>::from_row_major);
        velocity.check_covariance()?;
        Matrix::check_parts(&independent, &dependent)?;
        limits.check_member(self.header.source)?;
        limits.check_time(&self.header)
    }

    /// P, the sum of both parts, 3×3, full row-major (m², m·rad, rad²).
    #[must_use]
    pub fn total(&self) -> [f64; 9] {
        core::array::from_fn(|place| self.independent[place] + self.dependent[place])
    }

    /// Whether the robot knows where it is.
    #[must_use]
    pub fn state(&self) -> BeliefState {
        BeliefState::from_byte(self.state)
    }

    /// Whether the pose is good enough to drive on.
    #[must_use]
    pub fn is_fit(&self) -> bool {
        self.fit == 1
    }

    /// Why it is not; `None` where it is.
    #[must_use]
    pub fn why_unfit(&self) -> Option<WhyUnfit> {
        let [sigma_m, sigma_rad] = worst_sigmas(&self.total());
        let limit = f64::from(self.fit_limit);
        match Unfit::from_byte(self.unfit) {
            _ if self.is_fit() => None,
            Some(Unfit::Position) => Some(WhyUnfit::Position {
                sigma_m,
                limit_m: limit,
            }),
            Some(Unfit::Heading) => Some(WhyUnfit::Heading {
                sigma_rad,
                limit_rad: limit,
            }),
            Some(Unfit::Belief) | None => Some(WhyUnfit::Belief(self.state())),
        }
    }

    /// What `coloc-bounds` says of it, where `colocd` is asked to hear that.
    #[must_use]
    pub fn opinion(&self) -> Opinion {
        Opinion::from_byte(self.opinion)
    }

    /// How `input` was doing at this tick.
    #[must_use]
    pub fn health_of(&self, input: Input) -> Health {
        Health::from_byte(self.health[input as usize])
    }
}
