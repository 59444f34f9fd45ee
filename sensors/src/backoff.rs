//! When to open again what was lost.

use std::time::{Duration, Instant};

const FIRST: Duration = Duration::from_millis(100);
const LONGEST: Duration = Duration::from_secs(3);

/// 0.1, 0.2, 0.4 … 3 s between attempts: quick after a plug that was loose, cheap while the device is away.
#[derive(Copy, Clone, Debug, Default)]
pub struct Backoff {
    next: Option<(Instant, Duration)>,
}

impl Backoff {
    /// How long to wait yet; zero before anything has failed.
    #[must_use]
    pub fn left(&self, now: Instant) -> Duration {
        self.next
            .map_or(Duration::ZERO, |(at, _)| at.saturating_duration_since(now))
    }

    /// An attempt has failed, or what was open was lost.
    pub fn failed(&mut self, now: Instant) {
        let pause = self
            .next
            .map_or(FIRST, |(_, pause)| (2 * pause).min(LONGEST));
        self.next = Some((now + pause, pause));
    }

    /// It works again.
    pub fn worked(&mut self) {
        self.next = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pause_doubles_up_to_its_limit_and_starts_over() {
        let now = Instant::now();
        let mut backoff = Backoff::default();
        assert_eq!(backoff.left(now), Duration::ZERO);
        let mut pauses = Vec::new();
        for _ in 0..7 {
            backoff.failed(now);
            pauses.push(backoff.left(now).as_millis());
        }
        assert_eq!(pauses, [100, 200, 400, 800, 1600, 3000, 3000]);
        assert_eq!(backoff.left(now + LONGEST), Duration::ZERO);
        backoff.worked();
        backoff.failed(now);
        assert_eq!(backoff.left(now), FIRST);
    }
}
