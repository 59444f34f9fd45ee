//! What the link that runs here knows of the others: versions and clocks.
use std::path::Path;

use super::Findings;
use crate::post::{WRONG, ask};

/// Asks the link that runs here.
pub(super) fn look(directory: &Path, findings: &mut Findings) {
    match ask(directory) {
        Some(known) => tell(&known, findings),
        None => findings.tell(
            "peers",
            "coloc-link does not run here: their versions and clocks are known while it does",
        ),
    }
}

pub(super) fn tell(known: &str, findings: &mut Findings) {
    for line in known.lines() {
        if let Some(wrong) = line.strip_prefix(WRONG) {
            findings.warn(wrong.into());
        } else if let Some((name, text)) = line.split_once(": ") {
            findings.tell(name, text);
        }
    }
}
