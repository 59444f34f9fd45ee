//! A file that is written to for long: somebody may delete it meanwhile, and the kernel takes what is written all the same.

use std::fs::File;
use std::os::unix::fs::MetadataExt;

/// An open file, and whether it had a name that it can lose. Pipes and devices have none.
#[derive(Debug)]
pub(crate) struct Output {
    pub(crate) file: File,
    had_name: bool,
}

impl Output {
    pub(crate) fn new(file: File) -> Self {
        // What is opened through /proc may have none from the start.
        let had_name = names(&file).is_some_and(|names| names > 0);
        Self { file, had_name }
    }

    /// Whether nobody will find what is written to it.
    pub(crate) fn is_deleted(&self) -> bool {
        self.had_name && names(&self.file) == Some(0)
    }
}

/// How many names an ordinary file has.
fn names(file: &File) -> Option<u64> {
    let found = file.metadata().ok()?;
    found.is_file().then_some(found.nlink())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn only_a_file_that_had_a_name_can_lose_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("file");
        let output = Output::new(File::create(&path).unwrap());
        std::fs::rename(&path, path.with_extension("1")).unwrap();
        assert!(!output.is_deleted(), "it was moved");
        std::fs::remove_dir_all(directory.path()).unwrap();
        assert!(output.is_deleted());
        assert!(!Output::new(tempfile::tempfile().unwrap()).is_deleted());
        let device = File::open(Path::new("/dev/null")).unwrap();
        assert!(!Output::new(device).is_deleted());
    }
}
