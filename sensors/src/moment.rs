//! Now, by the clocks that stamps are of.

use coloc_shm_types::{Clock, Header};
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

    /// By `CLOCK_BOOTTIME` of this computer, whose start is `own_boot`, the moment that a header is of (ns); `None` if its clock cannot be
    /// compared with that.
    #[must_use]
    pub fn boottime_of(&self, header: &Header, own_boot: u64) -> Option<i64> {
        match header.clock() {
            Ok(Clock::Boottime) => {
                (header.boot == own_boot && own_boot != 0).then_some(header.stamp_ns)
            }
            Ok(Clock::Realtime) => {
                let ago_ns = self.realtime_ns.checked_sub(header.stamp_ns)?;
                self.boottime_ns.checked_sub(ago_ns)
            }
            Ok(Clock::Tai) | Err(_) => None,
        }
    }
}

fn read(clock: ClockId) -> i64 {
    let now = clock_gettime(clock);
    now.tv_sec
        .saturating_mul(1_000_000_000)
        .saturating_add(now.tv_nsec)
}
