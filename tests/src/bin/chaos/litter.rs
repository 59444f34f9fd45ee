//! Whether files of the dead stay.

use std::collections::{BTreeMap, BTreeSet};

use crate::fault::{Outcome, fault};
use crate::files::{Entry, list};

/// Rounds after which whatever is still there was left by somebody who has died: all but the kept have ended by then.
const ROUNDS: u32 = 4;

/// What is in a space beyond that of those who live throughout.
#[derive(Debug, Default)]
pub(crate) struct Litter {
    kept: BTreeSet<Entry>,
    /// Since how many rounds.
    others: BTreeMap<Entry, u32>,
    most: usize,
}

impl Litter {
    /// From here on nothing of this may go.
    pub(crate) fn keep(&mut self, files: BTreeSet<Entry>) {
        self.kept = files;
        self.others.clear();
    }

    /// At the end of a round, in which everybody else has ended.
    pub(crate) fn look(&mut self, files: BTreeSet<Entry>) -> Outcome {
        if let Some(gone) = self.kept.difference(&files).next() {
            fault!("taken from the living: {}", gone.path.display());
        }
        self.most = self.most.max(files.len());
        let others = files
            .into_iter()
            .filter(|entry| !self.kept.contains(entry) && !entry.is_of_a_name());
        let age = |entry: &Entry| self.others.get(entry).map_or(0, |rounds| rounds + 1);
        self.others = others.map(|entry| (entry.clone(), age(&entry))).collect();
        let old: Vec<Entry> = self
            .others
            .iter()
            .filter(|(_, rounds)| **rounds >= ROUNDS)
            .map(|(entry, _)| entry.clone())
            .collect();
        if old.is_empty() {
            return Ok(());
        }
        fault!("left of the dead, {ROUNDS} rounds later: {}", list(&old))
    }

    pub(crate) fn is_kept(&self, entry: &Entry) -> bool {
        self.kept.contains(entry)
    }

    pub(crate) fn figures(&self) -> String {
        format!(
            "at most {} files, {} of the living",
            self.most,
            self.kept.len()
        )
    }
}
