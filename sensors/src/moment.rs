//! Now, by the clocks that stamps are of.

use rustix::time::{ClockId, clock_gettime};

/// One moment.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Moment {
    /// By `CLOCK_BOOTTIME` (ns).
    pub boottime_ns: i64,
    /// By `CLOCK_REALTIME` (ns): since 1970, without leap seconds.
    pub realtime_ns: i64,
}

impl Moment {
    /// This one.
    #[must_use]
    pub fn now() -> Self {
        Self {
            boottime_ns: read(ClockId::Boottime),
            realtime_ns: read(ClockId::Realtime),
        }
    }
}

fn read(clock: ClockId) -> i64 {
    let now = clock_gettime(clock);
    now.tv_sec
        .saturating_mul(1_000_000_000)
        .saturating_add(now.tv_nsec)
}
