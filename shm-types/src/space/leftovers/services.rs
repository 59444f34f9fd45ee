//! Below `services`: each file describes a service, whose participants are listed in a segment. Who takes part holds both.
use std::path::PathBuf;

use rustix::fs::Mode;

use super::{Found, Turn, remove_unless_held, segments};
use crate::space::config::Place;
use crate::space::services::{DESCRIPTION, DIRECTORY};

/// Of a file that is complete.
const COMPLETE: Mode = Mode::RUSR;

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

/// Removes descriptions whose list of participants is gone, whoever holds them: nobody can take part any more, and whoever
/// does cannot be found. For whoever has passed the gate, and has found a service so for a while: programs that know nothing
/// of the gate remove the one a moment before the other.
pub(crate) fn remove_headless(place: &Place) -> usize {
    // The participants come first and go first, so a complete description that is older than this list has them in it.
    let descriptions: Vec<_> = super::list(&place.root().join(DIRECTORY))
        .filter_map(Found::look)
        .filter(|file| file.mode == COMPLETE && ending(place, file).is_some())
        .collect();
    let segments = segments::list(place);
    descriptions
        .iter()
        .filter(|description| participants(place, description, &segments).is_none())
        .filter(|description| description.remove())
        .count()
}

/// Of the name of the participants' segment.
fn ending(place: &Place, description: &Found) -> Option<String> {
    let service = description
        .name()
        .strip_prefix(place.prefix())?
        .strip_suffix(DESCRIPTION)?;
    Some(format!("_{service}{PARTICIPANTS}"))
}

fn participants(place: &Place, description: &Found, segments: &[PathBuf]) -> Option<Found> {
    let ending = ending(place, description)?;
    let segment = segments
        .iter()
        .find(|path| super::name(path).ends_with(&ending))?;
    Found::look(segment.clone())
}
