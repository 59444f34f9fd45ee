//! Below `services`: each file describes a service, whose participants are listed in a segment. Who takes part holds both.
use std::path::PathBuf;

use super::{Found, Turn, remove_unless_held};
use crate::space::config::Place;

const DIRECTORY: &str = "services";
const DESCRIPTION: &str = ".service";
const PARTICIPANTS: &str = ".dynamic";

/// Removes those in which nobody takes part.
pub(super) fn remove(place: &Place, segments: &[PathBuf], turn: Turn) -> usize {
    let descriptions: Vec<_> = super::list(&place.root().join(DIRECTORY)).collect();
    turn.of(&descriptions)
        .filter_map(|path| Found::look(path.clone()))
        .map(|description| {
            let participants = participants(place, &description, segments);
            let files: Vec<_> = participants.iter().chain([&description]).collect();
            remove_unless_held(&files)
        })
        .sum()
}

fn participants(place: &Place, description: &Found, segments: &[PathBuf]) -> Option<Found> {
    let service = description
        .name()
        .strip_prefix(place.prefix())?
        .strip_suffix(DESCRIPTION)?;
    let ending = format!("_{service}{PARTICIPANTS}");
    let segment = segments
        .iter()
        .find(|path| super::name(path).ends_with(&ending))?;
    Found::look(segment.clone())
}
