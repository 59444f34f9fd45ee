//! Finds and reads the test vectors: cases with results of an independent implementation, which are not part of
//! the repository.

use std::path::{Path, PathBuf};
use std::{env, fs};

use serde::de::DeserializeOwned;

/// The vectors in `file`; `None`, and a loud line, on a machine that does not have them.
///
/// # Panics
/// If the file is there but is not what the test expects: that must not pass for a missing file.
pub(crate) fn read_vectors<T: DeserializeOwned>(file: &str) -> Option<T> {
    let Some(directory) = directory() else {
        eprintln!("SKIPPED: no test vectors; set COLOC_VECTORS to the directory that holds {file}");
        return None;
    };
    let path = directory.join(file);
    let text =
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Some(serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

/// `COLOC_VECTORS`, else `shared/vectors` beside the repository or above it.
fn directory() -> Option<PathBuf> {
    if let Some(given) = env::var_os("COLOC_VECTORS") {
        return Some(given.into());
    }
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    above
        .map(|parent| parent.join("shared/vectors"))
        .find(|candidate| candidate.is_dir())
}

/// The names of the files in a folder of the vectors, in their order; `None`, and a loud line, on a machine that does not have it.
///
/// # Panics
/// If the folder is there and cannot be read, or is empty.
#[allow(dead_code)] // Not every test reads whole folders.
pub(crate) fn files_in(folder: &str) -> Option<Vec<String>> {
    let Some(directory) = directory()
        .map(|it| it.join(folder))
        .filter(|it| it.is_dir())
    else {
        eprintln!(
            "SKIPPED: no test vectors; set COLOC_VECTORS to the directory that holds {folder}"
        );
        return None;
    };
    let entries = fs::read_dir(&directory).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let is_case = |name: &String| Path::new(name).extension().is_some_and(|it| it == "json");
    let mut names: Vec<_> = names.filter(is_case).collect();
    names.sort();
    assert!(!names.is_empty(), "{} is empty", directory.display());
    Some(names)
}
