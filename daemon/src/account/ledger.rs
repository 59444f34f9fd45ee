//! A second's account, handed from the real-time thread to telemetry and back, so that neither allocates nor waits.

use coloc_shm_types::{Latency, Status};
use hdrhistogram::Histogram;

/// Counters since the start, and the latencies since this ledger was handed out.
#[derive(Clone, Debug)]
pub struct Ledger {
    /// All counters since the start; percentiles are telemetry's to fill in.
    pub status: Status,
    latency: Histogram<u64>,
}

/// 1 ns to 10 s, to one percent.
const RANGE_NS: (u64, u64) = (1, 10_000_000_000);
const DIGITS: u8 = 2;

impl Default for Ledger {
    fn default() -> Self {
        #[allow(clippy::expect_used)] // Constants of this file; any test would show it.
        let latency = Histogram::new_with_bounds(RANGE_NS.0, RANGE_NS.1, DIGITS)
            .expect("the bounds are legal");
        let mut ledger = Self {
            status: Status::default(),
            latency,
        };
        ledger.clear(); // Writes every count: no page of them is missing later.
        ledger
    }
}

impl Ledger {
    /// Counts a tick's latency; beyond the range it counts as the range's end. Never allocates.
    pub fn record(&mut self, latency_ns: u64) {
        self.latency.saturating_record(latency_ns);
    }

    /// Takes in the latencies of another ledger.
    pub fn add(&mut self, other: &Self) {
        // Equal bounds: nothing can fail to fit.
        let _ = self.latency.add(&other.latency);
    }

    /// Forgets the latencies.
    pub fn clear(&mut self) {
        self.latency.reset();
    }

    /// Percentiles of all that was recorded.
    #[must_use]
    pub fn percentiles(&self) -> Latency {
        let at = |quantile| self.latency.value_at_quantile(quantile);
        Latency {
            p50_ns: at(0.5),
            p90_ns: at(0.9),
            p99_ns: at(0.99),
            p999_ns: at(0.999),
            max_ns: self.latency.max(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_within_a_percent() {
        let mut ledger = Ledger::default();
        (1..=1000).for_each(|micros| ledger.record(micros * 1000));
        let Latency {
            p50_ns,
            p99_ns,
            max_ns,
            ..
        } = ledger.percentiles();
        assert!((495_000..=505_000).contains(&p50_ns), "{p50_ns}");
        assert!((980_000..=1_000_000).contains(&p99_ns), "{p99_ns}");
        assert!(max_ns >= 1_000_000, "{max_ns}");
    }

    #[test]
    fn what_is_beyond_the_range_is_not_lost() {
        let mut ledger = Ledger::default();
        ledger.record(u64::MAX);
        assert!(ledger.percentiles().max_ns >= RANGE_NS.1);
    }
}
