//! Below `services`: each file describes a service, whose participants are listed in a segment. Who takes part holds both.
use super::{Found, remove_unless_held};
use crate::space::config::Place;

const DIRECTORY: &str = "services";
const DESCRIPTION: &str = ".service";
const PARTICIPANTS: &str = ".dynamic";

/// Removes those in which nobody takes part.
pub(super) fn remove(place: &Place, segments: &[Found]) -> usize {
    super::list(&place.root().join(DIRECTORY))
        .filter_map(Found::look)
        .map(|description| {
            let participants = participants(place, &description, segments);
            let files: Vec<_> = participants.into_iter().chain([&description]).collect();
            remove_unless_held(&files)
        })
        .sum()
}

fn participants<'a>(
    place: &Place,
    description: &Found,
    segments: &'a [Found],
) -> Option<&'a Found> {
    let service = description
        .name()
        .strip_prefix(place.prefix())?
        .strip_suffix(DESCRIPTION)?;
    let ending = format!("_{service}{PARTICIPANTS}");
    segments.iter().find(|file| file.name().ends_with(&ending))
}
