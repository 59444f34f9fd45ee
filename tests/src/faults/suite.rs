//! All faults in a row.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::{FAULTS, Fault, play};
use crate::rig::{Line, Stamps};

/// Plays those faults that are `possible` here, all of them even when one fails, with frame stamps that can be believed and
/// with such that cannot, and says how each went.
/// `COLOC_FAULT` in the environment picks those with that in their name.
///
/// # Panics
/// If one failed, or none was played.
pub fn play_all(possible: impl Fn(&Fault) -> bool, line: impl Fn(&Path) -> Line) {
    let wanted = std::env::var("COLOC_FAULT").unwrap_or_default();
    let (mut played, mut failed) = (0, Vec::new());
    for fault in FAULTS.iter().filter(|fault| fault.name.contains(&wanted)) {
        if !possible(fault) {
            eprintln!("  left out: {} (cannot be made on this bus)", fault.name);
            continue;
        }
        played += 1;
        for stamps in [Stamps::Plausible, Stamps::Unbelievable] {
            let well = catch_unwind(AssertUnwindSafe(|| play(fault, &line, stamps))).is_ok();
            let word = if well { "as stated" } else { "NOT AS STATED" };
            eprintln!("  {word}: {}, frame stamps {stamps:?}", fault.name);
            failed.extend((!well).then_some((fault.name, stamps)));
        }
    }
    assert!(
        failed.is_empty(),
        "{} of {played} faults: {failed:?}",
        failed.len()
    );
    assert!(played > 0, "no fault has {wanted:?} in its name");
}
