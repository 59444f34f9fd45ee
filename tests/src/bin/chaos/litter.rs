//! Whether files of the dead stay.

use std::collections::{BTreeMap, BTreeSet};

use crate::fault::{Outcome, fault};
use crate::files::{Entry, list};

/// Rounds after which whatever is still there was left by somebody who has died: all but the kept have ended by then.
const ROUNDS: u32 = 4;

/// So many may still be in use by the living: connections of which they have not yet heard that they are over.
const USED: usize = 4;

/// What is in a space beyond that of those who live throughout.
#[derive(Debug, Default)]
pub(crate) struct Litter {
    kept: BTreeSet<Entry>,
    others: BTreeMap<Entry, Age>,
    most: usize,
}

/// How old a file is \[rounds\].
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
struct Age {
    seen: u32,
    /// Since somebody who lives let go of it: whoever comes next removes it.
    unheld: u32,
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
        self.others = others
            .map(|entry| {
                let age = self.others.get(&entry).map(|age| age.next(&entry, held));
                (entry, age.unwrap_or_default())
            })
            .collect();
        let of = |old: fn(&Age) -> bool| -> Vec<Entry> {
            let old = self.others.iter().filter(|(_, age)| old(age));
            old.map(|(entry, _)| entry.clone()).collect()
        };
        let left = of(|age| age.unheld >= ROUNDS);
        // The living let go of what they shared with the dead when somebody takes its place.
        let used = of(|age| age.seen >= ROUNDS && age.unheld < ROUNDS);
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

impl Age {
    fn next(self, entry: &Entry, held: &BTreeSet<u64>) -> Self {
        let is_held = held.contains(&entry.inode);
        Self {
            seen: self.seen + 1,
            unheld: if is_held { 0 } else { self.unheld + 1 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_the_living_let_go_of_has_as_long_to_vanish_as_any_other() {
        let entry = Entry {
            path: "/dev/shm/one".into(),
            inode: 7,
        };
        let (files, held) = (BTreeSet::from([entry]), BTreeSet::from([7]));
        let mut litter = Litter::default();
        let mut stays = |held: &BTreeSet<u64>| litter.look(files.clone(), held).is_ok();
        assert!((0..9).all(|_| stays(&held)));
        let let_go: Vec<bool> = (0..5).map(|_| stays(&BTreeSet::new())).collect();
        assert_eq!(let_go, [true, true, true, false, false]);
    }
}
