//! What a computation takes of this machine.

use std::time::Instant;

use rustix::time::{ClockId, clock_gettime};

/// Time and memory.
#[derive(Copy, Clone, Debug)]
pub(super) struct Cost {
    pub(super) wall_s: f64,
    /// Of all threads.
    pub(super) cpu_s: f64,
    /// Most memory that the program had by its end; `None` where the kernel does not say.
    pub(super) peak_mib: Option<f64>,
}

impl Cost {
    #[allow(clippy::cast_precision_loss)] // Ticks are far below 2^53.
    pub(super) fn ns_per(&self, ticks: u64) -> f64 {
        1e9 * self.cpu_s / ticks.max(1) as f64
    }
}

/// What `compute` gives, and what it took.
pub(super) fn of<T>(compute: impl FnOnce() -> T) -> (T, Cost) {
    let (wall, cpu_s) = (Instant::now(), processor_time_s());
    let result = compute();
    let cost = Cost {
        wall_s: wall.elapsed().as_secs_f64(),
        cpu_s: processor_time_s() - cpu_s,
        peak_mib: peak_mib(),
    };
    (result, cost)
}

#[allow(clippy::cast_precision_loss)] // Below 2^53 ns.
fn processor_time_s() -> f64 {
    let spent = clock_gettime(ClockId::ProcessCPUTime);
    spent.tv_sec as f64 + 1e-9 * spent.tv_nsec as f64
}

fn peak_mib() -> Option<f64> {
    peak_in(&std::fs::read_to_string("/proc/self/status").ok()?)
}

fn peak_in(status: &str) -> Option<f64> {
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read_where_the_kernel_says_it() {
        let status = "Name:\tcoloc\nVmPeak:\t  9216 kB\nVmHWM:\t    2048 kB\n";
        assert_eq!(peak_in(status), Some(2.0));
        assert_eq!(peak_in("Name:\tcoloc\n"), None);
    }

    #[test]
    fn work_takes_processor_time() {
        let (sum, cost) =
            of(|| (0..20_000_000_u64).fold(0, |sum, it| std::hint::black_box(sum ^ it)));
        assert!(cost.cpu_s > 0.0 && cost.ns_per(1) > 0.0, "{sum} {cost:?}");
    }
}
