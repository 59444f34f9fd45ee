//! What a daemon has counted.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::{BusState, Health, Input, Limits, Reject};

/// `coloc/<robot>/status`: every counter since the start of the daemon, once a second.
///
/// Counters only grow while `header.session_ns` stays the same; a rate is the difference of two messages.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Status.v1")]
pub struct Status {
    /// When it was counted, session and sequence of the daemon.
    pub header: Header,
    /// Ticks since the daemon started.
    pub tick: u64,
    /// Ticks that woke later than one period after their deadline.
    pub deadline_misses: u64,
    /// Largest wake-up lateness (ns).
    pub worst_lateness_ns: u64,
    /// From wake-up to publication.
    pub latency: Latency,
    /// Inputs that changed the belief, by [`Input`].
    pub accepted: [u64; Input::COUNT],
    /// Inputs that did not, by [`Input`], then by [`Reject`].
    pub rejected: [[u64; Reject::COUNT]; Input::COUNT],
    /// The wheel encoders' buses, all of them together.
    pub can: CanCounters,
    /// Telemetry events that were dropped because their ring was full.
    pub lost_events: u64,
    /// [`Health`] by [`Input`], one byte each; read it with [`Self::health_of`].
    pub health: [u8; Input::COUNT],
    /// Team number of the robot.
    pub robot: u16,
    /// [`BusState`] of the worst bus; read it with [`Self::bus_state`].
    pub bus: u8,
    /// Zero.
    pub reserved: u8,
}

layout!(Status, 552;
    header: 0, tick: 24, deadline_misses: 32, worst_lateness_ns: 40, latency: 48, accepted: 88, rejected: 120,
    can: 472, lost_events: 536, health: 544, robot: 548, bus: 550, reserved: 551,
);

impl Status {
    /// Checks that it is of the team and of the time; counters may be anything.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        limits.check_member(self.robot)?;
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

    /// State of the worst of the wheel encoders' buses.
    #[must_use]
    pub fn bus_state(&self) -> BusState {
        BusState::from_byte(self.bus)
    }
}

/// Percentiles over all ticks since the start (ns).
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Latency.v1")]
pub struct Latency {
    /// Half of the ticks took at most this.
    pub p50_ns: u64,
    /// 90 % of the ticks took at most this.
    pub p90_ns: u64,
    /// 99 % of the ticks took at most this.
    pub p99_ns: u64,
    /// 99.9 % of the ticks took at most this.
    pub p999_ns: u64,
    /// The slowest tick.
    pub max_ns: u64,
}

layout!(Latency, 40; p50_ns: 0, p90_ns: 8, p99_ns: 16, p999_ns: 24, max_ns: 32);

/// What the CAN source has counted.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.CanCounters.v1")]
pub struct CanCounters {
    /// Encoder frames that were received, good or bad.
    pub frames: u64,
    /// Error frames of any class.
    pub error_frames: u64,
    /// Encoder frames whose checksum was wrong.
    pub checksum_errors: u64,
    /// Encoder frames that were too short or could not be decoded.
    pub malformed: u64,
    /// Frames that are missing by the alive counter.
    pub alive_skips: u64,
    /// Frames that came again by the alive counter.
    pub alive_repeats: u64,
    /// Frames the kernel dropped because the receive buffer was full.
    pub rx_overflows: u64,
    /// Times the bus was opened again.
    pub reopens: u64,
}

layout!(CanCounters, 64;
    frames: 0, error_frames: 8, checksum_errors: 16, malformed: 24, alive_skips: 32, alive_repeats: 40,
    rx_overflows: 48, reopens: 56,
);
