//! Notices when the ticks stop.

use std::time::{Duration, Instant};

use tracing::{error, info};

pub(super) struct Watchdog {
    patience: Duration,
    last_beat: u64,
    since: Instant,
    barked: bool,
}

impl Watchdog {
    /// Speaks when there was no tick for `patience`.
    pub(super) fn new(patience: Duration) -> Self {
        Self {
            patience,
            last_beat: 0,
            since: Instant::now(),
            barked: false,
        }
    }

    /// The last tick was `beat`.
    pub(super) fn look(&mut self, beat: u64) {
        if beat != self.last_beat {
            if self.barked {
                info!(
                    silent_ms = self.since.elapsed().as_millis(),
                    "the tick is back"
                );
            }
            (self.last_beat, self.since, self.barked) = (beat, Instant::now(), false);
        } else if self.since.elapsed() > self.patience && !self.barked {
            error!(
                tick = beat,
                silent_ms = self.since.elapsed().as_millis(),
                "no tick: the real-time thread does not run"
            );
            self.barked = true;
        }
    }
}
