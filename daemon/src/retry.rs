//! When to try again what has failed: soon at first, then ever more rarely.

use std::time::{Duration, Instant};

const FIRST: Duration = Duration::from_secs(1);
const LONGEST: Duration = Duration::from_secs(60);

/// Due at once until something has failed.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Retry {
    after: Option<(Instant, Duration)>,
}

impl Retry {
    /// Whether the pause after the last failure is over.
    pub(crate) fn is_due(&self) -> bool {
        self.after
            .is_none_or(|(failed, pause)| failed.elapsed() >= pause)
    }

    /// It failed once more: how long to leave it alone.
    pub(crate) fn failed(&mut self) -> Duration {
        let pause = self
            .after
            .map_or(FIRST, |(_, pause)| (2 * pause).min(LONGEST));
        self.after = Some((Instant::now(), pause));
        pause
    }

    /// It works; whether it had failed before.
    pub(crate) fn worked(&mut self) -> bool {
        self.after.take().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_up_to_a_minute_and_a_success_forgets_them() {
        let mut retry = Retry::default();
        assert!(retry.is_due());
        let pauses: Vec<u64> = (0..8).map(|_| retry.failed().as_secs()).collect();
        assert_eq!(pauses, [1, 2, 4, 8, 16, 32, 60, 60]);
        assert!(!retry.is_due());
        assert!(retry.worked() && retry.is_due());
        assert!(!retry.worked());
    }
}
