//! Files for what is read from files.

use std::path::PathBuf;

use tempfile::TempDir;

thread_local! {
    /// In memory: millions of them are written.
    static DIRECTORY: TempDir = TempDir::new_in("/dev/shm").unwrap();
}

/// A file of this name and content.
pub(super) fn file(name: &str, content: &[u8]) -> PathBuf {
    let path = DIRECTORY.with(|directory| directory.path().join(name));
    std::fs::write(&path, content).unwrap();
    path
}
