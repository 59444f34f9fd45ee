//! How long ticks take.
use iceoryx2::prelude::ZeroCopySend;

use crate::layout::layout;

/// Percentiles over all ticks since the start (ns).
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Latency.v2")]
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
