//! What is promised about the first MR.CLAM recording holds with few runs too.

use std::env;
use std::path::PathBuf;
use std::sync::Arc;

use coloc_sim::evaluate::EvalWorld;
use coloc_sim::mrclam::Recording;
use coloc_sim::promises::promises;

const RUNS: u16 = 4;

fn recording() -> Option<Recording> {
    let walked = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let above = walked.ancestors().map(|folder| folder.join("shared/data"));
    let given = env::var_os("COLOC_DATA").map(PathBuf::from);
    let folder = given
        .into_iter()
        .chain(above)
        .map(|data| data.join("mrclam1"));
    let folder = folder.into_iter().find(|folder| folder.is_dir());
    if folder.is_none() {
        eprintln!("SKIPPED: no recording mrclam1: set COLOC_DATA to the folder that has it");
    }
    folder.map(|folder| Recording::load(&folder).expect("a whole recording"))
}

#[test]
fn the_promises_about_recording_1_are_kept() {
    let Some(recording) = recording() else {
        return;
    };
    let world = EvalWorld::Recorded(Arc::new(recording.resample()));
    let promises = promises(&world, RUNS, 1, &|_| ()).expect("sensible");
    assert!(promises.len() >= 24, "{} promises", promises.len());
    for promise in &promises {
        assert!(promise.kept, "{promise:?}");
    }
}
