//! The kernel's clocks, read as one.

use rustix::time::{ClockId, DynamicClockId, Timespec, clock_gettime, clock_gettime_dynamic};

use super::{Reading, TimeSource};

/// The kernel's clocks, which are read through the vDSO, mostly without a system call.
#[derive(Copy, Clone, Debug, Default)]
pub struct KernelTime;

/// Clocks read within so little time were read at one moment \[ns\]; who is interrupted between two of them reads again.
const ONE_MOMENT_NS: i64 = 200_000;
const READ_ATTEMPTS: usize = 5;

impl TimeSource for KernelTime {
    fn read(&self) -> Reading {
        at_one_moment(read_once)
    }

    fn now_ns(&self) -> i64 {
        nanos(clock_gettime(ClockId::Boottime))
    }
}

/// The best of a few readings, once one is good enough.
fn at_one_moment(mut read: impl FnMut() -> Reading) -> Reading {
    let mut best = read();
    for _ in 1..READ_ATTEMPTS {
        if best.width_ns <= ONE_MOMENT_NS {
            break;
        }
        best = std::cmp::min_by_key(best, read(), |reading| reading.width_ns);
    }
    best
}

fn read_once() -> Reading {
    let boot_ns = nanos(clock_gettime(ClockId::Boottime));
    let realtime_ns = nanos(clock_gettime(ClockId::Realtime));
    // Every kernel since 3.10 has it.
    let tai_ns = clock_gettime_dynamic(DynamicClockId::Tai).map_or(realtime_ns, nanos);
    let width_ns = nanos(clock_gettime(ClockId::Boottime)) - boot_ns;
    Reading {
        boot_ns,
        realtime_ns,
        tai_ns,
        width_ns,
    }
}

fn nanos(time: Timespec) -> i64 {
    time.tv_sec
        .saturating_mul(1_000_000_000)
        .saturating_add(time.tv_nsec)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inner_clock_goes_on_between_two_readings() {
        let first = KernelTime.read();
        let second = KernelTime.read();
        assert!(first.width_ns >= 0 && second.boot_ns >= first.boot_ns + first.width_ns);
        assert!(second.realtime_ns > 0 && second.tai_ns > 0);
    }
    #[test]
    fn who_was_interrupted_reads_again_and_keeps_the_best() {
        let width_and_attempts = |widths_us: &[i64]| {
            let mut attempts = 0;
            let read = || {
                let width_ns = widths_us[attempts] * 1000;
                attempts += 1;
                Reading {
                    width_ns,
                    ..Reading::default()
                }
            };
            (at_one_moment(read).width_ns / 1000, attempts)
        };
        assert_eq!(width_and_attempts(&[200, 1]), (200, 1), "good enough");
        assert_eq!(width_and_attempts(&[5000, 900, 100, 1]), (100, 3));
        assert_eq!(width_and_attempts(&[500, 400, 300, 600, 700, 1]), (300, 5));
    }
}
