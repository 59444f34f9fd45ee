//! What became of leaders' words.
use iceoryx2::prelude::ZeroCopySend;

use crate::layout::layout;

/// Of a robot with a part in `[assist]`, since its start; all zero where it has none. What was refused is counted in
/// [`Status::rejected`](super::Status::rejected), what was gated too.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.AssistCounters.v2")]
pub struct AssistCounters {
    /// Taken, to be fused.
    pub accepted: u64,
    /// Not taken: a pose of that leader was there already, or the event was over. No fault of anybody.
    pub declined: u64,
    /// Told to children.
    pub forwarded: u64,
    /// Sightings that count as used because no answer came.
    pub timed_out: u64,
    /// Of these, freed by a late "no".
    pub freed_late: u64,
    /// Events that were over before their time, because too many were open.
    pub closed_early: u64,
    /// Poses of a leader that knew something else of the event than one whose pose was taken, where leaders know all readings.
    pub disagreed: u64,
    /// So many children are seen and do not answer now.
    pub mutes: u16,
    /// Team number of the first of them; 0 where there is none.
    pub mute: u16,
    /// Zero.
    pub reserved: [u8; 4],
}

layout!(AssistCounters, 64; accepted: 0, declined: 8, forwarded: 16, timed_out: 24, freed_late: 32, closed_early: 40, disagreed: 48,
    mutes: 56, mute: 58, reserved: 60);
