//! Notices when the ticks stop.

use std::time::{Duration, Instant};

use tracing::{error, info, warn};

/// How long a start may take before a word is due.
const START: Duration = Duration::from_secs(2);

pub(super) struct Watchdog {
    patience: Duration,
    last_beat: u64,
    since: Instant,
    barked: bool,
}

/// What there is to say, and since when there was no tick.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Word {
    /// There was none at all yet.
    Starting(Duration),
    Started(Duration),
    Silent(Duration),
    Back(Duration),
}

impl Watchdog {
    /// Speaks when there was no tick for `patience`, from the first one on.
    pub(super) fn new(patience: Duration, now: Instant) -> Self {
        Self {
            patience,
            last_beat: 0,
            since: now,
            barked: false,
        }
    }

    /// The last tick was `beat`; 0 if there was none yet.
    pub(super) fn look(&mut self, beat: u64, now: Instant) -> Option<Word> {
        let silence = now.saturating_duration_since(self.since);
        let is_starting = self.last_beat == 0;
        if beat != self.last_beat {
            let word = if is_starting {
                Word::Started
            } else {
                Word::Back
            };
            let word = self.barked.then(|| word(silence));
            (self.last_beat, self.since, self.barked) = (beat, now, false);
            return word;
        }
        let (patience, word): (_, fn(_) -> _) = if is_starting {
            (START, Word::Starting)
        } else {
            (self.patience, Word::Silent)
        };
        if silence <= patience || self.barked {
            return None;
        }
        self.barked = true;
        Some(word(silence))
    }
}

impl Word {
    pub(super) fn say(self, tick: u64) {
        match self {
            Self::Starting(silence) => warn!(
                silent_ms = silence.as_millis(),
                "still starting: there was no tick yet"
            ),
            Self::Started(silence) => info!(silent_ms = silence.as_millis(), "the first tick came"),
            Self::Silent(silence) => error!(
                tick,
                silent_ms = silence.as_millis(),
                "no tick: the real-time thread does not run"
            ),
            Self::Back(silence) => info!(silent_ms = silence.as_millis(), "the tick is back"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Duration = Duration::from_millis(200);

    /// What is said when the last tick was such at such times \[ms\].
    fn said(looks: &[(u64, u64)]) -> Vec<Word> {
        let start = Instant::now();
        let mut watchdog = Watchdog::new(PATIENCE, start);
        looks
            .iter()
            .filter_map(|&(ms, beat)| watchdog.look(beat, start + Duration::from_millis(ms)))
            .collect()
    }

    #[test]
    fn a_start_is_no_silence() {
        assert_eq!(said(&[(50, 0), (250, 0), (1900, 0), (1950, 1)]), []);
    }

    #[test]
    fn a_start_that_takes_long_is_told_as_such() {
        let (late, came) = (Duration::from_millis(2050), Duration::from_secs(5));
        assert_eq!(
            said(&[(2000, 0), (2050, 0), (3000, 0), (5000, 1), (5100, 5)]),
            [Word::Starting(late), Word::Started(came)]
        );
    }

    #[test]
    fn from_the_first_tick_on_silence_is_told_once_and_its_end() {
        let (silent, back) = (Duration::from_millis(250), Duration::from_millis(900));
        assert_eq!(
            said(&[(1000, 1), (1200, 1), (1250, 1), (1300, 1), (1900, 2)]),
            [Word::Silent(silent), Word::Back(back)]
        );
    }
}
