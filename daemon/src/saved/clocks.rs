//! When a belief was saved, for a process that has none of the clocks of the one that saved it.

use coloc_estimator::Span;
use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

/// A moment by the clocks that outlive a process.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct When {
    /// Which start of the kernel: `boottime_ns` counts from there.
    pub boot_id: String,
    /// `CLOCK_BOOTTIME`, which nobody sets and which goes on while the computer sleeps \[ns\].
    pub boottime_ns: i64,
    /// `CLOCK_REALTIME`: all there is across a restart of the computer \[ns\].
    pub realtime_ns: i64,
}

impl When {
    /// This moment.
    #[must_use]
    pub fn now() -> Self {
        // Without /proc no two moments are of the same boot: the wall clock counts.
        let boot_id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id");
        Self {
            boot_id: boot_id.unwrap_or_default().trim().into(),
            boottime_ns: nanos(ClockId::Boottime),
            realtime_ns: nanos(ClockId::Realtime),
        }
    }

    /// The moment of this boot that `CLOCK_BOOTTIME` called `boottime_ns`, not long ago.
    #[must_use]
    pub fn at(&self, boottime_ns: i64) -> Self {
        let ago = nanos(ClockId::Boottime).saturating_sub(boottime_ns);
        Self {
            boot_id: self.boot_id.clone(),
            boottime_ns,
            realtime_ns: nanos(ClockId::Realtime).saturating_sub(ago),
        }
    }

    /// How much later this is than `earlier` \[s\].
    #[must_use]
    pub fn since(&self, earlier: &Self) -> f64 {
        let same_boot = self.boot_id == earlier.boot_id && !self.boot_id.is_empty();
        let (now, then) = if same_boot {
            (self.boottime_ns, earlier.boottime_ns)
        } else {
            (self.realtime_ns, earlier.realtime_ns)
        };
        Span::from_nanos(now.saturating_sub(then)).as_seconds()
    }
}

fn nanos(clock: ClockId) -> i64 {
    let time = clock_gettime(clock);
    (time.tv_sec.saturating_mul(1_000_000_000)).saturating_add(time.tv_nsec)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    fn when(boot_id: &str, boottime_s: i64, realtime_s: i64) -> When {
        When {
            boot_id: boot_id.into(),
            boottime_ns: boottime_s * SECOND,
            realtime_ns: realtime_s * SECOND,
        }
    }

    #[track_caller]
    fn assert_age(age_s: f64, expected_s: f64) {
        assert!((age_s - expected_s).abs() < 1e-9, "{age_s} s");
    }

    #[test]
    fn a_wall_clock_that_was_set_ages_nothing_within_a_boot() {
        let saved = when("a", 100, 5_000);
        assert_age(when("a", 103, 9_999).since(&saved), 3.0);
        assert_age(when("a", 103, 1).since(&saved), 3.0);
    }

    #[test]
    fn across_a_restart_only_the_wall_clock_counts() {
        let saved = when("a", 100, 5_000);
        assert_age(when("b", 7, 5_020).since(&saved), 20.0);
        assert_age(when("", 7, 5_020).since(&when("", 3, 5_000)), 20.0);
    }

    #[test]
    fn the_kernels_clocks_go_on_together() {
        let begin = When::now();
        assert!(!begin.boot_id.is_empty());
        let before = begin.at(nanos(ClockId::Boottime) - 2 * SECOND);
        let age_s = When::now().since(&before);
        assert!((2.0..60.0).contains(&age_s), "{age_s}");
    }
}
