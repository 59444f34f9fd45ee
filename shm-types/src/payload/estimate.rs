//! What a robot believes.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::matrix::Matrix;
use crate::{Health, Input, Limits, Reject};

/// `coloc/<robot>/estimate`: the belief of every tick; a late joiner gets the last one.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Estimate.v1")]
pub struct Estimate {
    /// Stamp of the tick, session and sequence of the daemon.
    pub header: Header,
    /// Ticks since the daemon started.
    pub tick: u64,
    /// Kernel receive stamp of the newest encoder frame in this estimate (ns of the configured clock); 0 if none yet.
    pub frame_stamp_ns: i64,
    /// From this tick's stamp to just before this message was sent (ns).
    pub latency_ns: u64,
    /// Wake-up lateness of this tick against its deadline (ns).
    pub lateness_ns: u64,
    /// From the wake-up of this tick until all its inputs were there (ns); 4.29 s and more are [`u32::MAX`].
    pub collect_ns: u32,
    /// The estimator's step of this tick (ns).
    pub estimate_ns: u32,
    /// Sending the estimate and neighbours their poses (ns): at the tick before, as no message knows its own.
    pub publish_ns: u32,
    /// Counting (ns): at the tick before.
    pub account_ns: u32,
    /// `[x, y, φ]` in the common frame (m, m, rad).
    pub pose: [f64; 3],
    /// `[v_x, v_y, ω]` in the body frame (m/s, m/s, rad/s).
    pub velocity: [f64; 3],
    /// P, 3×3, full row-major.
    pub total: [f64; 9],
    /// `P_i`, 3×3, full row-major.
    pub independent: [f64; 9],
    /// [`Health`] by [`Input`], one byte each; read it with [`Self::health_of`].
    pub health: [u8; Input::COUNT],
    /// Team number of the robot.
    pub robot: u16,
    /// Zero.
    pub reserved: [u8; 2],
}

layout!(Estimate, 272;
    header: 0, tick: 24, frame_stamp_ns: 32, latency_ns: 40, lateness_ns: 48, collect_ns: 56, estimate_ns: 60,
    publish_ns: 64, account_ns: 68, pose: 72, velocity: 96,
    total: 120, independent: 192, health: 264, robot: 268, reserved: 270,
);

impl Estimate {
    /// Checks what a reader needs: finite, both covariances and their difference valid, of the team, of the time.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        Limits::check_finite(&self.pose)?;
        Limits::check_finite(&self.velocity)?;
        let total = Matrix::<3>::from_row_major(self.total);
        Matrix::check_split(&total, &Matrix::<3>::from_row_major(self.independent))?;
        limits.check_member(self.robot)?;
        limits.check_time(&self.header)
    }

    /// How `input` was doing at this tick.
    #[must_use]
    pub fn health_of(&self, input: Input) -> Health {
        Health::from_byte(self.health[input as usize])
    }
}
