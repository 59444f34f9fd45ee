//! The demo's time: `CLOCK_BOOTTIME`, which never steps, and world time, which starts with the robots.

use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// `CLOCK_BOOTTIME` \[ns\].
pub(crate) fn now_ns() -> i64 {
    let now = clock_gettime(ClockId::Boottime);
    now.tv_sec * NANOS_PER_SECOND + now.tv_nsec
}

/// By how much `CLOCK_REALTIME` is ahead of it at this moment \[ns\].
pub(crate) fn wall_ahead_ns() -> i64 {
    let wall = clock_gettime(ClockId::Realtime);
    wall.tv_sec * NANOS_PER_SECOND + wall.tv_nsec - now_ns()
}

/// Sleeps until `CLOCK_BOOTTIME` shows `deadline_ns`, or a little later; signals do not cut it short.
pub(crate) fn sleep_until(deadline_ns: i64) {
    let deadline = Timespec {
        tv_sec: deadline_ns / NANOS_PER_SECOND,
        tv_nsec: deadline_ns % NANOS_PER_SECOND,
    };
    while clock_nanosleep_absolute(ClockId::Boottime, &deadline) == Err(rustix::io::Errno::INTR) {}
}

/// World time of a stamp, where the world started at `start_ns` \[s\].
#[allow(clippy::cast_precision_loss)] // A run is far below 2^53 ns (104 days).
pub(crate) fn world_time_s(stamp_ns: i64, start_ns: i64) -> f64 {
    stamp_ns.saturating_sub(start_ns) as f64 / 1e9
}
