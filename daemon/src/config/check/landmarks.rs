//! Landmarks that are listed twice, or that nobody looks for.

use super::super::Config;
use super::super::finding::Finding;

pub(super) fn refusals(config: &Config) -> impl Iterator<Item = Finding> {
    (0..config.landmark.len())
        .filter_map(|index| twice(config, index))
        .chain(unheard(config))
}

fn twice(config: &Config, index: usize) -> Option<Finding> {
    let number = config.landmark[index].number;
    let problem = format!(" = {number}: is the number of two landmarks; numbers must differ");
    let mut earlier = config.landmark[..index].iter();
    earlier
        .any(|it| it.number == number)
        .then(|| Finding::new(format!("landmark.{index}.number"), problem))
}

fn unheard(config: &Config) -> Option<Finding> {
    let problem = ": is of no use without sighting.heard = true";
    let is_unheard = !config.sighting.heard && !config.landmark.is_empty();
    is_unheard.then(|| Finding::new("landmark", problem))
}
