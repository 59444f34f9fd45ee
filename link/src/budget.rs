//! How many bytes a second a member may be sent.

/// A bucket that fills with time.
#[derive(Copy, Clone, Debug)]
pub struct Budget {
    per_s: f64,
    held: f64,
    at_ns: i64,
}

/// It holds as much as comes in so long (s).
const HELD_S: f64 = 0.25;
/// It always holds a message of this size (bytes).
const LEAST: f64 = 4096.0;

impl Budget {
    /// `per_s` bytes a second from `now_ns` on (ns of any clock that never steps).
    #[must_use]
    pub fn new(per_s: f64, now_ns: i64) -> Self {
        let held = most(per_s);
        Self {
            per_s,
            held,
            at_ns: now_ns,
        }
    }

    /// Takes so many bytes out, and says how long it is empty then (s).
    #[expect(clippy::cast_precision_loss, reason = "of nanoseconds and bytes")]
    pub fn take(&mut self, bytes: usize, now_ns: i64) -> f64 {
        let passed_s = now_ns.saturating_sub(self.at_ns) as f64 * 1e-9;
        self.at_ns = now_ns;
        self.held = self
            .per_s
            .mul_add(passed_s, self.held)
            .min(most(self.per_s));
        self.held -= bytes as f64;
        (-self.held / self.per_s).max(0.0)
    }
}

fn most(per_s: f64) -> f64 {
    (per_s * HELD_S).max(LEAST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_the_long_run_no_more_is_sent_than_allowed() {
        let mut budget = Budget::new(10_000.0, 0);
        let mut now_ns = 0;
        let mut sent = 0;
        while now_ns < 10_000_000_000 {
            let wait_s = budget.take(500, now_ns);
            sent += 500;
            #[expect(clippy::cast_possible_truncation)]
            let wait_ns = (wait_s * 1e9) as i64;
            now_ns += wait_ns.max(1_000_000);
        }
        assert!((100_000..=105_000).contains(&sent), "{sent}");
    }

    #[test]
    fn who_was_silent_may_send_a_burst_of_a_quarter_of_a_second() {
        let mut budget = Budget::new(100_000.0, 0);
        for _ in 0..25 {
            assert!(budget.take(1000, 3_600_000_000_000) <= 0.0);
        }
        assert!(budget.take(1000, 3_600_000_000_000) > 0.0);
    }
}
