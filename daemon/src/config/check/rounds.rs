//! Whether a robot that is to make rounds can.

use super::super::finding::Finding;
use super::super::{Config, GyroSource, Propagation};

/// Robots in a team that makes rounds: a round's message has no room for more.
const MOST: usize = 16;

pub(super) fn refusal(config: &Config) -> Option<Finding> {
    if !config.makes_rounds() {
        return None;
    }
    let cannot = |problem: String| {
        Some(Finding::new(
            "fusion.mode",
            format!(" = \"rounds\": {problem}"),
        ))
    };
    let robots = config.peers().count() + 1;
    let rounds = &config.rounds;
    match () {
        () if config.fusion.paper || config.fusion.propagation == Propagation::Paper => {
            cannot("is not the paper's".into())
        }
        () if config.gyro.source != GyroSource::None => {
            cannot("a robot with a gyro makes none yet; set gyro.source = \"none\"".into())
        }
        () if config.assist.is_on() => cannot("nobody is carried by leaders as well".into()),
        () if robots > MOST => cannot(format!("[[team]] has {robots} robots, {MOST} are the most")),
        () if rounds.deadline_s * rounds.rate_hz >= 1.0 => cannot(format!(
            "rounds.deadline_s = {} is no shorter than a slot of rounds.rate_hz = {}",
            rounds.deadline_s, rounds.rate_hz
        )),
        () => None,
    }
}
