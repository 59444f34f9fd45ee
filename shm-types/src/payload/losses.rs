//! What was lost on its way through a daemon.
use iceoryx2::prelude::ZeroCopySend;

use crate::layout::layout;

/// What never came to a daemon or never left it, beside frames (see [`CanCounters`](super::CanCounters)) and messages that are
/// missing in the count of their source (see [`SourceHealth`](super::SourceHealth)).
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Losses.v2")]
pub struct Losses {
    /// Events for telemetry that found no room: lines of the log and of the recording, accounts.
    pub events: u64,
    /// Estimates and poses for neighbours that did not reach everybody who listens.
    pub undelivered: u64,
    /// Times that the messages of some publisher could not be read.
    pub unreadable: u64,
    /// Poses for neighbours and verdicts that found no room in a tick.
    pub overflowed: u64,
    /// Measurements that were folded before their time, because the history was full: what comes late cannot go before them.
    pub folded_early: u64,
    /// Times of ticks that found no room: they give way to all other events.
    pub timings: u64,
    /// Zero, for counters to come.
    pub spare: [u64; 2],
}

layout!(Losses, 64; events: 0, undelivered: 8, unreadable: 16, overflowed: 24, folded_early: 32, timings: 40, spare: 48);
