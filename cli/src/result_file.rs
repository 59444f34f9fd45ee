//! Files that a command was asked to write. Each is tried before anything is computed, and then is there as a whole or as it
//! was before: it is written beside its place and renamed.

use std::fs::{File, Metadata, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

/// A file or folder that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {path}: {reason}", path = path.display())]
pub(crate) struct WriteError {
    path: PathBuf,
    reason: String,
}

impl WriteError {
    pub(crate) fn new(path: &Path, reason: &(impl std::fmt::Display + ?Sized)) -> Self {
        Self {
            path: path.to_owned(),
            reason: reason.to_string(),
        }
    }
}

/// A file that can be written, as far as one can know.
#[derive(Debug)]
pub(crate) struct ResultFile {
    /// As it was asked for.
    path: PathBuf,
    way: Way,
}

#[derive(Debug)]
enum Way {
    /// Beside this path, then renamed.
    Beside(PathBuf),
    /// Over what is there: its folder takes no new files.
    Over(PathBuf),
    /// Into a pipe or a device.
    Into(File),
}

impl ResultFile {
    /// Tries whether `path` can be written, and leaves it as it is.
    pub(crate) fn prepare(path: &Path) -> Result<Self, WriteError> {
        let way = way(path).map_err(|error| WriteError::new(path, &error))?;
        Ok(Self {
            path: path.to_owned(),
            way,
        })
    }

    /// The same of one that must not be there yet: what a person may have changed since is not overwritten.
    pub(crate) fn prepare_new(path: &Path) -> Result<Self, WriteError> {
        if std::fs::symlink_metadata(path).is_ok() {
            return Err(WriteError::new(
                path,
                "it is there already: give a new name",
            ));
        }
        Self::prepare(path)
    }

    /// Refuses two that are one file: the second would take the first one's place.
    pub(crate) fn check_apart(&self, other: &Self) -> Result<(), WriteError> {
        if self.target().is_some() && self.target() == other.target() {
            let reason = format!("that is {} too", other.path.display());
            return Err(WriteError::new(&self.path, &reason));
        }
        Ok(())
    }

    /// Whose place it takes; a pipe or a device takes both.
    fn target(&self) -> Option<&Path> {
        match &self.way {
            Way::Beside(target) | Way::Over(target) => Some(target),
            Way::Into(_) => None,
        }
    }

    pub(crate) fn write(&self, content: &[u8]) -> Result<(), WriteError> {
        let written = match &self.way {
            Way::Beside(target) => write_beside(target, content),
            Way::Over(target) => std::fs::write(target, content),
            Way::Into(file) => { file }.write_all(content),
        };
        written.map_err(|error| WriteError::new(&self.path, &error))
    }
}

/// Makes a folder and the way to it where they are missing, and tries whether it takes files.
pub(crate) fn prepare_folder(path: &Path) -> Result<(), WriteError> {
    let made = std::fs::create_dir_all(path).and_then(|()| NamedTempFile::new_in(path).map(drop));
    made.map_err(|error| WriteError::new(path, &without_path(&error)))
}

/// Writes a file that nobody prepared.
pub(crate) fn write(path: &Path, content: &[u8]) -> Result<(), WriteError> {
    ResultFile::prepare(path)?.write(content)
}

fn way(path: &Path) -> io::Result<Way> {
    let there = match std::fs::metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        there => Some(there?),
    };
    let writable = || OpenOptions::new().write(true).open(path);
    let Some(there) = there else {
        let folder = folder_of(path);
        NamedTempFile::new_in(folder).map_err(|error| without_path(&error))?;
        // By whatever way it was named, so that it is known again.
        let target = folder
            .canonicalize()?
            .join(path.file_name().unwrap_or_default());
        return Ok(Way::Beside(target));
    };
    if !there.is_file() {
        return writable().map(Way::Into);
    }
    writable()?;
    // Behind a link, so that the link stays.
    let target = path.canonicalize()?;
    Ok(match NamedTempFile::new_in(folder_of(&target)) {
        Ok(_) => Way::Beside(target),
        Err(_) => Way::Over(target),
    })
}

fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    folder.unwrap_or(Path::new("."))
}

/// The reason alone: the name of the file that was tried helps nobody.
pub(crate) fn without_path(error: &io::Error) -> io::Error {
    let text = error.to_string();
    let reason = text.split(" at path ").next().unwrap_or_default();
    io::Error::new(error.kind(), reason)
}

fn write_beside(target: &Path, content: &[u8]) -> io::Result<()> {
    let there = std::fs::metadata(target).ok();
    // Whoever may read other new files may read this one.
    let mode = there.as_ref().map_or(0o666, mode_of);
    let mut file = Builder::new()
        .permissions(Permissions::from_mode(mode))
        .tempfile_in(folder_of(target))
        .map_err(|error| without_path(&error))?;
    file.write_all(content)
        .map_err(|error| without_path(&error))?;
    if there.is_some() {
        file.as_file()
            .set_permissions(Permissions::from_mode(mode))?;
    }
    match file.persist(target) {
        // A place that cannot be renamed over, such as a mount of one file.
        Err(error) if there.is_some() => std::fs::copy(error.file.path(), target).map(drop),
        persisted => persisted.map(drop).map_err(|error| error.error),
    }
}

fn mode_of(there: &Metadata) -> u32 {
    there.permissions().mode() & 0o777
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    fn entries(folder: &Path) -> usize {
        std::fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn until_it_is_written_nothing_is_there_and_what_was_stays() {
        let folder = tempfile::tempdir().unwrap();
        let new = ResultFile::prepare(&folder.path().join("new")).unwrap();
        assert_eq!(entries(folder.path()), 0);
        let old = folder.path().join("old");
        std::fs::write(&old, "before").unwrap();
        std::fs::set_permissions(&old, Permissions::from_mode(0o640)).unwrap();
        let file = ResultFile::prepare(&old).unwrap();
        assert_eq!(std::fs::read_to_string(&old).unwrap(), "before");
        file.write(b"after").unwrap();
        new.write(b"new").unwrap();
        assert_eq!(std::fs::read_to_string(&old).unwrap(), "after");
        assert_eq!(mode_of(&std::fs::metadata(&old).unwrap()), 0o640);
        assert_eq!(entries(folder.path()), 2, "nothing else is left");
    }

    #[test]
    fn a_link_stays_and_what_it_names_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::fs::write(&file, "before").unwrap();
        symlink(&file, &link).unwrap();
        write(&link, b"after").unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "after");
    }

    #[test]
    fn one_file_by_two_ways_is_recognised_and_a_device_takes_both() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("inner")).unwrap();
        std::fs::write(at("old"), "before").unwrap();
        symlink(at("old"), at("link")).unwrap();
        symlink(folder.path(), at("way")).unwrap();
        let apart = |a: &Path, b: &Path| {
            let [a, b] = [a, b].map(|path| ResultFile::prepare(path).unwrap());
            a.check_apart(&b).map_err(|error| error.to_string())
        };
        for (a, b) in [
            ("new", "new"),
            ("new", "inner/../new"),
            ("way/new", "new"),
            ("old", "link"),
        ] {
            let refusal = apart(&at(a), &at(b)).unwrap_err();
            assert!(refusal.ends_with(&format!("/{a}: that is {} too", at(b).display())));
        }
        assert_eq!(apart(&at("new"), &at("inner/new")), Ok(()));
        assert_eq!(
            apart(Path::new("/dev/null"), Path::new("/dev/null")),
            Ok(())
        );
    }

    #[test]
    fn a_device_is_written_into_and_stays_a_device() {
        write(Path::new("/dev/null"), b"gone").unwrap();
        assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
        let full = ResultFile::prepare(Path::new("/dev/full")).unwrap();
        let error = full.write(b"x").unwrap_err().to_string();
        assert!(
            error.starts_with("cannot write /dev/full: No space left"),
            "{error}"
        );
    }

    #[test]
    fn what_cannot_be_written_is_refused_with_its_name_and_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("missing/a.json");
        for (path, reason) in [
            (missing.as_path(), "No such file"),
            (folder.path(), "Is a directory"),
            (Path::new("/proc/a.json"), ""),
        ] {
            let error = ResultFile::prepare(path).unwrap_err().to_string();
            let begin = format!("cannot write {}: {reason}", path.display());
            assert!(error.starts_with(&begin), "{error}");
        }
        assert!(prepare_folder(Path::new("/proc/pictures")).is_err());
    }
}
