//! When to try again.

const FIRST_NS: i64 = 20_000_000;
const LONGEST_NS: i64 = 160_000_000;

/// Waits 20, 40, … 160 ms between attempts: quick after a hiccup, cheap during an outage.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Backoff {
    failures: u32,
    next_ns: Option<i64>,
}

impl Backoff {
    /// Whether it is time; the first question only starts the clock.
    pub(super) fn is_due(&mut self, now_ns: i64) -> bool {
        let next_ns = *self
            .next_ns
            .get_or_insert_with(|| now_ns.saturating_add(FIRST_NS));
        now_ns >= next_ns
    }

    /// An attempt has failed.
    pub(super) fn failed(&mut self, now_ns: i64) {
        self.failures = (self.failures + 1).min(8);
        let wait_ns = (FIRST_NS << self.failures).min(LONGEST_NS);
        self.next_ns = Some(now_ns.saturating_add(wait_ns));
    }

    /// An attempt has succeeded.
    pub(super) fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wait_doubles_up_to_its_limit_and_starts_over() {
        let mut backoff = Backoff::default();
        let mut attempts_ms = Vec::new();
        for now_ms in 0..900 {
            if backoff.is_due(now_ms * 1_000_000) {
                attempts_ms.push(now_ms);
                backoff.failed(now_ms * 1_000_000);
            }
        }
        assert_eq!(attempts_ms, [20, 60, 140, 300, 460, 620, 780]);
        backoff.reset();
        assert!(!backoff.is_due(0));
        assert!(backoff.is_due(FIRST_NS));
    }
}
