//! The tracks of MR.CLAM's robots come to what they are known to come to: there is no chance in them.

use std::path::PathBuf;

use coloc_sim::partial::{Form, tracks};

/// `COLOC_DATA`, or `shared/data` beside the repository or above it.
fn recordings() -> Option<PathBuf> {
    let given = std::env::var_os("COLOC_DATA").map(PathBuf::from);
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let above = here.ancestors().map(|folder| folder.join("shared/data"));
    let found = given.into_iter().chain(above).find(|it| it.is_dir());
    if found.is_none() {
        eprintln!("SKIPPED: no recordings; set COLOC_DATA to the folder that holds mrclam1");
    }
    found
}

#[test]
fn what_tracks_publish_is_what_they_are_known_to_publish() {
    let Some(data) = recordings() else { return };
    let finding = tracks::find(&Form::short(1, Some(data)));
    assert!(finding.text.lines().count() > 10, "{}", finding.text);
    assert!(finding.missed.is_empty(), "{:?}", finding.missed);
}
