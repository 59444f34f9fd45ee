//! Why a directory or file is not used, in words that tell a person what to do.
use std::io;
use std::path::{Path, PathBuf};

use crate::advice::advised;

/// A place where another user could read, change or plant something, or that the system refuses.
#[derive(Debug, thiserror::Error)]
pub enum NotPrivate {
    /// It is somebody else's.
    #[error(
        "{} belongs to user {owner}, this process runs as user {own}: \
         run everything on the robot as the same user, or choose another place",
        .path.display()
    )]
    WrongUser {
        /// The directory or file.
        path: PathBuf,
        /// Its owner's user number.
        owner: u32,
        /// The effective user number of this process.
        own: u32,
    },
    /// A symbolic link that somebody else made leads to an unknown place.
    #[error("{} is a symbolic link that user {owner} made, so it is not followed: remove it, or choose another place", .path.display())]
    StrangersLink {
        /// The link.
        path: PathBuf,
        /// Who made it.
        owner: u32,
    },
    /// A directory on the way belongs to somebody who could exchange what is below it.
    #[error("{} belongs to user {owner}, who could put something else into its place: choose another place than {}", .parent.display(), .path.display())]
    StrangersParent {
        /// What was wanted.
        path: PathBuf,
        /// The directory on the way.
        parent: PathBuf,
        /// Whose it is.
        owner: u32,
    },
    /// Anybody could exchange what is below a directory on the way.
    #[error(
        "others may write to {} (mode {mode:04o}) and put something else into its place: \
         close it (chmod go-w {}), or choose another place than {}",
        .parent.display(), .parent.display(), .path.display()
    )]
    OpenParent {
        /// What was wanted.
        path: PathBuf,
        /// The directory on the way.
        parent: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// The directory was open to others, and what is in it need not be coloc's.
    #[error(
        "{} is open to others (mode {mode:04o}) and contains `{entry}`, which coloc did not put there: \
         choose a directory that holds nothing else; if it is all right, close it (chmod 700 {})",
        .path.display(), .path.display()
    )]
    Foreign {
        /// The directory.
        path: PathBuf,
        /// Its mode.
        mode: u32,
        /// What is in it.
        entry: String,
    },
    /// Its file system knows no modes.
    #[error("{} stays open to others (mode {mode:04o}), whatever is asked for: choose a place on another file system", .path.display())]
    CannotClose {
        /// The directory.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// There is something else.
    #[error("{} is not a directory: remove it, or choose another place", .path.display())]
    NotADirectory {
        /// What is there.
        path: PathBuf,
    },
    /// There is something else.
    #[error("{} is not an ordinary file: remove it, or choose another one", .path.display())]
    NotAFile {
        /// What is there.
        path: PathBuf,
    },
    /// Others may have the file under another name.
    #[error("{} has {links} names (hard links), so others may have it too: remove it, or choose another one", .path.display())]
    ManyNames {
        /// The file.
        path: PathBuf,
        /// How many names.
        links: u64,
    },
    /// Others may have written it.
    #[error("others may write to {} (mode {mode:04o}), so it is not believed: remove it, or close it (chmod 600 {})", .path.display(), .path.display())]
    OpenFile {
        /// The file.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// Nothing that coloc writes is that long.
    #[error("{} is longer than {limit} bytes, so coloc did not write it: remove it", .path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
        /// What is read at most (bytes).
        limit: u64,
    },
    /// The operating system refused something.
    #[error("cannot {action} {}: {}", .path.display(), advised(.source))]
    System {
        /// What was tried, as in "cannot …".
        action: &'static str,
        /// On which path.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
}

impl NotPrivate {
    pub(super) fn system<E: Into<io::Error>>(
        action: &'static str,
        path: &Path,
    ) -> impl FnOnce(E) -> Self {
        move |source| Self::System {
            action,
            path: path.into(),
            source: source.into(),
        }
    }

    /// What kind of error it is for those who ask no more; a refusal of ours counts as a denied permission.
    #[must_use]
    pub fn kind(&self) -> io::ErrorKind {
        match self {
            Self::System { source, .. } => source.kind(),
            _ => io::ErrorKind::PermissionDenied,
        }
    }
}

impl From<NotPrivate> for io::Error {
    fn from(refusal: NotPrivate) -> Self {
        Self::new(refusal.kind(), refusal)
    }
}
