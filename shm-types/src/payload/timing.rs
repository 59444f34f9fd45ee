//! Where the time of a tick went.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;
use crate::{Limits, Reject};

/// `coloc/<robot>/timing`: where the time went inside of the daemon, one message for each tick. For who measures the daemon; who
/// uses the pose needs none of it.
///
/// They come in bursts, up to 50 ms after their ticks. All durations are of this very tick.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Timing.v2")]
pub struct Timing {
    /// The tick's stamp by the configured clock; `source` is the robot's team number. Whatever is missing by `sequence` was
    /// lost because nobody had time for it.
    pub header: Header,
    /// The same moment by `CLOCK_BOOTTIME` of the robot's computer (ns).
    pub boot_ns: i64,
    /// Ticks since the daemon started: that of the [`Estimate`](super::Estimate) with the same number.
    pub tick: u64,
    /// When the newest encoder frame that is in the estimate was received by the kernel (ns of the configured clock); 0 if there
    /// was none yet.
    pub frame_stamp_ns: i64,
    /// From that moment until the estimate was sent (ns): waking, draining the bus, computing and sending. 0 if no newer frame
    /// came than at the tick before.
    pub latency_ns: u64,
    /// From the tick's stamp until the estimate was ready to be sent (ns).
    pub since_tick_ns: u64,
    /// How much later than its deadline the tick woke (ns).
    pub lateness_ns: u64,
    /// From the wake-up until all inputs were there (ns); 4.29 s and more are [`u32::MAX`], here and below.
    pub collect_ns: u32,
    /// The estimator's step (ns).
    pub estimate_ns: u32,
    /// Sending the estimate, and neighbours their poses (ns).
    pub publish_ns: u32,
    /// Counting, and telling the telemetry thread (ns).
    pub account_ns: u32,
}

layout!(Timing, 104;
    header: 0, boot_ns: 40, tick: 48, frame_stamp_ns: 56, latency_ns: 64, since_tick_ns: 72, lateness_ns: 80, collect_ns: 88,
    estimate_ns: 92, publish_ns: 96, account_ns: 100,
);

impl Timing {
    /// Checks that it is of the team and of the time; durations may be anything.
    ///
    /// # Errors
    /// The first reason, in the order of [`Reject`].
    pub fn validate(&self, limits: &Limits) -> Result<(), Reject> {
        limits.check_member(self.header.source)?;
        limits.check_time(&self.header)
    }
}
