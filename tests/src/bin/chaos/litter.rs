//! Whether files of the dead stay.

use std::collections::{BTreeMap, BTreeSet};

use crate::fault::{Outcome, fault};
use crate::files::{Entry, list};

/// Rounds after which whatever is still there was left by somebody who has died: all but the kept have ended by then.
const ROUNDS: u32 = 4;

/// So many may still be in use by the living: places of readers that nobody has taken since.
const USED: usize = 16;

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
    ///
    /// `held` are the inodes that the living have open or mapped.
    pub(crate) fn look(&mut self, files: BTreeSet<Entry>, held: &BTreeSet<u64>) -> Outcome {
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
        // The living let go of what they shared with the dead when somebody takes its place.
        let (used, left): (Vec<Entry>, Vec<Entry>) = old
            .into_iter()
            .partition(|entry| held.contains(&entry.inode));
        if left.is_empty() && used.len() <= USED {
            return Ok(());
        }
        let (used, left) = (list(&used), list(&left));
        fault!("left of the dead, {ROUNDS} rounds later: {left}; in use by the living: {used}")
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
