//! Whether a robot that hears of others by way of `coloc-track` can.

use super::super::Config;
use super::super::finding::Finding;

pub(super) fn refusal(config: &Config) -> Option<Finding> {
    if !config.sighting.through_track {
        return None;
    }
    let cannot = |problem: &str| {
        Some(Finding::new(
            "sighting.through_track",
            format!(" = true: {problem}"),
        ))
    };
    match () {
        () if !config.sighting.heard => cannot("is of no use without sighting.heard = true"),
        () if config.assist.is_on() => cannot("nobody is carried by leaders as well"),
        () if config.makes_rounds() => cannot("is not for who makes rounds"),
        () => None,
    }
}
