//! How much is remembered.

use coloc_estimator::MOST_SLOTS;

use super::super::finding::Finding;
use super::super::{Config, History};

/// What it takes to apply a measurement of the history again, where it is a neighbour's pose \[s\].
const REPLAY_S: f64 = 450e-9;

/// How long and how large it may be.
pub(super) fn refusal(config: &Config) -> Option<Finding> {
    shortest(config).or_else(|| capacity(config))
}

/// What a tick takes in came since the last one: no less must be remembered.
fn shortest(config: &Config) -> Option<Finding> {
    let (length_s, rate_hz) = (config.history.length_s, config.tick.rate_hz);
    let problem = format!(
        " = {length_s}: must be {} s or more at {rate_hz} Hz, a tick's period: what came right after the last tick would be \
         rejected as too old",
        1.0 / rate_hz
    );
    (length_s * rate_hz < 1.0).then(|| Finding {
        or: &["tick.rate_hz"],
        ..Finding::new("history.length_s", problem)
    })
}

/// Measurements that a tick can apply again in a quarter of its period.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 1 s / 4 / 450 ns.
fn most(rate_hz: f64) -> usize {
    ((0.25 / rate_hz / REPLAY_S) as usize).min(MOST_SLOTS)
}

impl History {
    /// As by default, but no more than ticks of this rate can keep up with.
    #[must_use]
    #[allow(clippy::cast_precision_loss)] // Thousands.
    pub fn for_rate(rate_hz: f64) -> Self {
        let usual = Self::default();
        let capacity = usual.capacity.min(most(rate_hz));
        Self {
            capacity,
            length_s: usual.length_s.min(capacity as f64 / (2.0 * rate_hz)),
            ..usual
        }
    }
}

/// A history that is full forgets. One that is large makes a long tick of a late measurement: everything since is applied
/// again.
fn capacity(config: &Config) -> Option<Finding> {
    let (history, rate_hz) = (&config.history, config.tick.rate_hz);
    // 60 s × 1 kHz × 2; a length that was computed from a rate is not to fail by its last bit.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let least = (2.0 * history.length_s * rate_hz - 1e-6).ceil() as usize;
    let most = most(rate_hz);
    if least > most {
        return Some(length(history, rate_hz, most));
    }
    let problem = match history.capacity {
        capacity if capacity < least => {
            format!("{least} or more, two places for every tick of history.length_s")
        }
        capacity if capacity > most => {
            format!(
                "{most} or less, for a tick to apply all of them again in a quarter of its period"
            )
        }
        _ => return None,
    };
    let problem = format!(" = {}: must be {problem}", history.capacity);
    Some(Finding {
        or: &["history.length_s", "tick.rate_hz"],
        ..Finding::new("history.capacity", problem)
    })
}

fn length(history: &History, rate_hz: f64, most: usize) -> Finding {
    #[allow(clippy::cast_precision_loss)] // Thousands.
    let longest_s = most as f64 / (2.0 * rate_hz);
    let problem = format!(
        " = {}: must be {longest_s} s or less at {rate_hz} Hz: a tick can apply {most} measurements again in a quarter of \
         its period, and there are two places for each",
        history.length_s
    );
    Finding {
        or: &["tick.rate_hz"],
        ..Finding::new("history.length_s", problem)
    }
}

#[cfg(test)]
mod tests {
    use coloc_shm_types::RobotName;

    use super::super::super::Robot;
    use super::*;

    #[test]
    fn ticks_of_any_rate_keep_up_with_the_history_that_is_made_for_it() {
        let name = RobotName::new("a").unwrap();
        let mut config = Config::of(Robot { name, id: 1 });
        for rate_hz in 1..=1000 {
            config.tick.rate_hz = f64::from(rate_hz);
            config.history = History::for_rate(config.tick.rate_hz);
            assert_eq!(refusal(&config), None, "{rate_hz} Hz: {:?}", config.history);
        }
        assert_eq!(History::for_rate(50.0), History::default());
    }
}
