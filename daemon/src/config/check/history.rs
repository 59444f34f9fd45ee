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

/// A history that is full forgets. One that is large makes a long tick of a late measurement: everything since is applied
/// again.
fn capacity(config: &Config) -> Option<Finding> {
    let (history, rate_hz) = (&config.history, config.tick.rate_hz);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    // 60 s × 1 kHz × 2; 1 s / 4 / 450 ns.
    let [least, most] = [
        (2.0 * history.length_s * rate_hz).ceil(),
        0.25 / rate_hz / REPLAY_S,
    ]
    .map(|count| count as usize);
    let most = most.min(MOST_SLOTS);
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
