//! What a space has in the file system.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

pub(crate) const SHARED_MEMORY: &str = "/dev/shm";

/// A file, and which one under that name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Entry {
    pub(crate) path: PathBuf,
    pub(crate) inode: u64,
}

/// All files below `root`, and those in shared memory whose names begin with `prefix`.
pub(crate) fn of(root: &Path, prefix: &str) -> BTreeSet<Entry> {
    let mut found = BTreeSet::new();
    collect(root, &|_| true, &mut found);
    let ours = |path: &Path| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().starts_with(prefix)
    };
    collect(Path::new(SHARED_MEMORY), &ours, &mut found);
    found
}

/// Whoever vanishes meanwhile is not there.
fn collect(directory: &Path, wanted: &dyn Fn(&Path) -> bool, found: &mut BTreeSet<Entry>) {
    for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
        let path = entry.path();
        let Ok(metadata) = fs::symlink_metadata(&path) else {
            continue;
        };
        if metadata.is_dir() {
            collect(&path, wanted, found);
        } else if wanted(&path) {
            let inode = metadata.ino();
            found.insert(Entry { path, inode });
        }
    }
}

/// Inodes of the files that a process has mapped or open.
pub(crate) fn held_by(pid: u32) -> Vec<u64> {
    let maps = fs::read_to_string(format!("/proc/{pid}/maps")).unwrap_or_default();
    let mapped = maps
        .lines()
        .filter_map(|line| line.split_whitespace().nth(4)?.parse().ok());
    let open = fs::read_dir(format!("/proc/{pid}/fd"));
    let open = open.into_iter().flatten().flatten();
    let open = open.filter_map(|entry| Some(fs::metadata(entry.path()).ok()?.ino()));
    mapped.chain(open).collect()
}

impl Entry {
    /// One for each robot or service that there ever was, whoever comes: it may stay until the space is empty.
    pub(crate) fn is_of_a_name(&self) -> bool {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let of_a_service = [".service", ".dynamic"].map(|end| name.ends_with(end));
        let of_a_robot = name.contains(".claim_") || self.path.iter().any(|part| part == "claims");
        of_a_robot || of_a_service.contains(&true)
    }
}

/// The first few, for a person.
pub(crate) fn list<'a>(entries: impl IntoIterator<Item = &'a Entry>) -> String {
    let names: Vec<String> = entries
        .into_iter()
        .map(|entry| entry.path.display().to_string())
        .collect();
    let more = if names.len() > 8 { ", ..." } else { "" };
    format!(
        "{} files: {}{more}",
        names.len(),
        names[..names.len().min(8)].join(", ")
    )
}
