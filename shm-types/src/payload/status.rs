//! What a daemon has counted.
use iceoryx2::prelude::ZeroCopySend;

use super::{AssistCounters, CanCounters, Header, Latency, Losses, SourceHealth};
use crate::layout::layout;
use crate::{BeliefState, BusState, Health, Input, Limits, Reject, Unfit};

/// `coloc/<robot>/status`: every counter since the start of the daemon, once a second.
///
/// Counters only grow while `header.session` stays the same; a rate is the difference of two messages.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Status.v6")]
pub struct Status {
    /// When it was counted, by the configured clock; `source` is the robot's team number.
    pub header: Header,
    /// Ticks since the daemon started.
    pub tick: u64,
    /// Deadlines that passed before their tick woke; one late tick can miss several.
    pub deadline_misses: u64,
    /// Largest wake-up lateness (ns).
    pub worst_lateness_ns: u64,
    /// From wake-up to publication.
    pub latency: Latency,
    /// Inputs that changed the belief, by [`Input`].
    pub accepted: [u64; Input::PLACES],
    /// Inputs that did not, by [`Input`], then by [`Reject`].
    pub rejected: [[u64; Reject::PLACES]; Input::PLACES],
    /// The wheel encoders' buses, all of them together.
    pub can: CanCounters,
    /// What never came, or never went out.
    pub losses: Losses,
    /// A row for each sensor and each robot that was heard; see [`Self::sources`]. Of more than 32, one that is heard takes the
    /// row of one that is silent; while all of them are heard, those that came last have none.
    pub sources: [SourceHealth; Self::SOURCES],
    /// What the gyro reads when nothing turns, as far as it is known; 0 where there is no gyro (rad/s).
    pub gyro_bias_radps: f64,
    /// Its standard deviation; 0 where there is no gyro (rad/s).
    pub gyro_bias_sigma_radps: f64,
    /// [`Health`] by [`Input`], one byte each; read it with [`Self::health_of`].
    pub health: [u8; Input::PLACES],
    /// [`BusState`] of the worst bus; read it with [`Self::bus_state`].
    pub bus: u8,
    /// [`BeliefState`]; read it with [`Self::state`].
    pub state: u8,
    /// 1: fit to drive on; read it with [`Self::is_fit`].
    pub fit: u8,
    /// [`Unfit`]; read it with [`Self::unfit`]. 0 where it is fit.
    pub unfit: u8,
    /// What is exceeded: the largest σ that is configured for the position (m) or the heading (rad), by `unfit`; else 0.
    pub fit_limit: f32,
    /// What became of leaders' words.
    pub assist: AssistCounters,
}

layout!(Status, 6736;
    header: 0, tick: 40, deadline_misses: 48, worst_lateness_ns: 56, latency: 64, accepted: 104, rejected: 232,
    can: 4328, losses: 4520, sources: 4584, gyro_bias_radps: 6632, gyro_bias_sigma_radps: 6640, health: 6648, bus: 6664, state: 6665,
    fit: 6666, unfit: 6667, fit_limit: 6668, assist: 6672,
);

impl Status {
    /// Rows for sources.
    pub const SOURCES: usize = 32;

    /// Checks that it is of the team and of the time; counters may be anything.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        limits.check_member(self.header.source)?;
        limits.check_time(&self.header)
    }

    /// How `input` is doing.
    #[must_use]
    pub fn health_of(&self, input: Input) -> Health {
        Health::from_byte(self.health[input as usize])
    }

    /// How many of `input` changed the belief.
    #[must_use]
    pub fn accepted_of(&self, input: Input) -> u64 {
        self.accepted[input as usize]
    }

    /// How many of `input` were turned away for `reason`.
    #[must_use]
    pub fn rejected_of(&self, input: Input, reason: Reject) -> u64 {
        self.rejected[input as usize][reason as usize]
    }

    /// How many of `input` were turned away for any reason.
    #[must_use]
    pub fn rejected_total(&self, input: Input) -> u64 {
        self.rejected[input as usize]
            .iter()
            .fold(0, |sum, count| sum.saturating_add(*count))
    }

    /// The rows that are in use, with what each is a source of.
    pub fn sources(&self) -> impl Iterator<Item = (Input, &SourceHealth)> {
        self.sources
            .iter()
            .filter_map(|row| Some((row.input()?, row)))
    }

    /// State of the worst of the wheel encoders' buses.
    #[must_use]
    pub fn bus_state(&self) -> BusState {
        BusState::from_byte(self.bus)
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
    pub fn unfit(&self) -> Option<Unfit> {
        let said = Unfit::from_byte(self.unfit);
        (!self.is_fit()).then_some(said.unwrap_or(Unfit::Belief))
    }
}
