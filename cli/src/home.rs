//! Where a command keeps what it needs only while it runs: a folder in the temporary directory that nobody else can look into.
//! It goes with the command. What a command that was killed has left goes with the next one.
//!
//! Who uses such a folder holds a lock on it, which the kernel gives back whatever happens. A daemon that has outlived its
//! command for a moment holds the lock of its shared memory.

use std::ffi::OsStr;
use std::fs::{File, Permissions};
use std::io;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use coloc_shm_types::{OpenError, Space};
use rustix::fs::{FlockOperation, Mode, OFlags, flock};
use rustix::process::geteuid;
use tempfile::TempDir;

use crate::result_file::without_path;

/// How often a new folder may be taken for an abandoned one before it could be locked.
const TRIES: u32 = 10;

/// Longest path of a socket, and longest name that a participant of a local bus takes \[bytes\].
const SOCKET_PATH: usize = 107;
const SOCKET_NAME: usize = "4194304-99999-0123abcd".len();

/// What tells the folders of one command from others.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Kind {
    /// Begins the folder's name.
    pub(crate) name: &'static str,
    /// Begins the name of every file in shared memory.
    pub(crate) shm_prefix: &'static str,
}

/// There is no place to work in.
#[derive(Debug, thiserror::Error)]
#[error("cannot work in {place}: {reason}; set TMPDIR to another directory", place = place.display())]
pub(crate) struct NoHome {
    place: PathBuf,
    reason: String,
}

/// The folder of this process. The order of the fields is the order of leaving.
#[derive(Debug)]
pub(crate) struct Home {
    kind: Kind,
    folder: TempDir,
    _lock: File,
}

impl Home {
    /// Makes one that only this user may enter, in `place`.
    pub(crate) fn make(kind: Kind, place: &Path) -> Result<Self, NoHome> {
        let refused = |reason| NoHome {
            place: place.to_owned(),
            reason,
        };
        let home = Self::make_folder(kind, place)
            .map_err(|error| refused(without_path(&error).to_string()))?;
        home.check_path(place).map_err(refused)?;
        Ok(home)
    }

    fn make_folder(kind: Kind, place: &Path) -> io::Result<Self> {
        for _ in 0..TRIES {
            let folder = tempfile::Builder::new()
                .prefix(kind.name)
                .permissions(Permissions::from_mode(0o700))
                .tempdir_in(place)?;
            // Who cleans up may have come between: then it is gone or about to go.
            if let Some(lock) = lock(folder.path())? {
                return Ok(Self {
                    kind,
                    folder,
                    _lock: lock,
                });
            }
        }
        Err(io::Error::other("it is taken away again and again"))
    }

    /// Whether shared memory can be there. A person has named `place` and not what is below it.
    fn check_path(&self, place: &Path) -> Result<(), String> {
        let root = self.shm_root();
        let Err(OpenError::BadRoot { limit, .. }) = self.enter() else {
            return Ok(()); // What else may be wrong is not the path's fault.
        };
        let below = root
            .as_os_str()
            .len()
            .saturating_sub(place.as_os_str().len());
        let limit = limit.saturating_sub(below);
        Err(format!(
            "shared memory needs a path of at most {limit} bytes, in ASCII letters"
        ))
    }

    /// Whether the sockets of a local bus can be in `folder`, which is below this one.
    pub(crate) fn check_sockets(&self, folder: &Path) -> Result<(), NoHome> {
        let longest = folder.as_os_str().len() + "/".len() + SOCKET_NAME;
        let place = self.path().parent().unwrap_or(Path::new("/"));
        match longest.saturating_sub(SOCKET_PATH) {
            0 => Ok(()),
            excess => Err(NoHome {
                place: place.into(),
                reason: format!(
                    "the sockets of local buses need a path of at most {} bytes",
                    place.as_os_str().len().saturating_sub(excess)
                ),
            }),
        }
    }

    /// Whoever is alone in a space takes everything out when it leaves.
    fn enter(&self) -> Result<Space, OpenError> {
        Space::open(&self.shm_root(), self.kind.shm_prefix, "coloc-home")
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Root of the shared memory.
    pub(crate) fn shm_root(&self) -> PathBuf {
        shm_root(self.path())
    }
}

impl Home {
    /// Roots of so many spaces, each as on a computer of its own.
    pub(crate) fn shm_roots(&self, count: usize) -> Vec<PathBuf> {
        let root = |place| self.path().join(format!("shm{place}"));
        (1..=count).map(root).collect()
    }
}

/// All that are there in a folder.
fn roots_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let named = entries.filter(|it| it.file_name().to_string_lossy().starts_with("shm"));
    named.map(|it| it.path()).collect()
}

/// Takes along what its processes have left in shared memory that were killed.
impl Drop for Home {
    fn drop(&mut self) {
        for root in roots_in(self.path()) {
            // Otherwise it goes with the next command.
            let _ = Space::open(&root, self.kind.shm_prefix, "coloc-home");
        }
    }
}

fn shm_root(folder: &Path) -> PathBuf {
    folder.join("shm")
}

/// Removes what commands of that kind have left in `place` when they were killed, with its shared memory. Says what went.
pub(crate) fn sweep(kind: Kind, place: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(place).into_iter().flatten().flatten();
    let named = |name: &OsStr| name.to_string_lossy().starts_with(kind.name);
    entries
        .filter(|entry| named(&entry.file_name()))
        .map(|entry| entry.path())
        .filter(|folder| remove(kind, folder).is_ok_and(|removed| removed))
        .collect()
}

/// Unless it is in use, or somebody else's.
fn remove(kind: Kind, folder: &Path) -> io::Result<bool> {
    let Some(_lock) = lock(folder)? else {
        return Ok(false);
    };
    for root in roots_in(folder) {
        if lock(&root)?.is_none() {
            return Ok(false);
        }
        // Whoever is alone in a space takes everything out when it leaves.
        Space::open(&root, kind.shm_prefix, "coloc-sweeper").map_err(io::Error::other)?;
    }
    std::fs::remove_dir_all(folder)?;
    Ok(true)
}

/// Whether somebody is in the shared memory at `root`.
pub(crate) fn is_inhabited(root: &Path) -> bool {
    root.exists() && lock(root).is_ok_and(|lock| lock.is_none())
}

/// The lock on a folder of this user; `None` if it is another's, or in use, or gone meanwhile. Links are not followed.
fn lock(folder: &Path) -> io::Result<Option<File>> {
    let flags = OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    let file: File = match rustix::fs::open(folder, flags, Mode::empty()) {
        Ok(file) => file.into(),
        Err(rustix::io::Errno::NOENT) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let locked = file.metadata()?.uid() == geteuid().as_raw()
        && flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok();
    // With the lock, nobody else removes it: what is there now stays there.
    Ok((locked && folder.exists()).then_some(file))
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    const KIND: Kind = Kind {
        name: "coloc-test-",
        shm_prefix: "coloctest",
    };

    #[test]
    fn a_home_is_private_in_use_and_gone_in_the_end() {
        let place = tempfile::tempdir().unwrap();
        let home = Home::make(KIND, place.path()).unwrap();
        let mode = home.path().metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o700);
        assert!(sweep(KIND, place.path()).is_empty(), "it is in use");
        assert!(home.path().exists());
        drop(home);
        assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_place_that_will_not_do_is_refused_with_the_way_out() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        for (name, reason) in [
            ("missing", "No such file or directory (os error 2); "),
            ("größe", "in ASCII letters; "),
            (
                &"long".repeat(20),
                "shared memory needs a path of at most 78 bytes",
            ),
        ] {
            if name != "missing" {
                std::fs::create_dir(at(name)).unwrap();
            }
            let refusal = Home::make(KIND, &at(name)).unwrap_err().to_string();
            let begin = format!("cannot work in {}: ", at(name).display());
            assert!(
                refusal.starts_with(&begin) && refusal.contains(reason),
                "{refusal}"
            );
            assert!(
                refusal.ends_with("set TMPDIR to another directory"),
                "{refusal}"
            );
        }
    }

    #[test]
    fn sockets_need_a_shorter_path_and_the_refusal_says_how_short() {
        let place = tempfile::tempdir_in("/tmp").unwrap();
        let check = |length: usize| {
            let missing = length - place.path().as_os_str().len() - "/".len();
            let at = place.path().join("p".repeat(missing));
            std::fs::create_dir_all(&at).unwrap();
            let home = Home::make(KIND, &at).unwrap();
            home.check_sockets(&home.path().join("buses/can32"))
        };
        let refusal = check(60).unwrap_err().to_string();
        assert!(refusal.contains("a path of at most 54 bytes"), "{refusal}");
        assert!(check(55).is_err() && check(54).is_ok());
    }

    #[test]
    fn what_nobody_lives_in_is_removed_and_nothing_else() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        for name in [
            "coloc-test-dead/shm/nodes",
            "coloc-other-dead",
            "coloc-test-lives/shm",
        ] {
            std::fs::create_dir_all(at(name)).unwrap();
        }
        symlink(at("coloc-other-dead"), at("coloc-test-link")).unwrap();
        let space = Space::open(&at("coloc-test-lives/shm"), KIND.shm_prefix, "daemon").unwrap();
        assert_eq!(sweep(KIND, place.path()), [at("coloc-test-dead")]);
        for name in ["coloc-other-dead", "coloc-test-lives", "coloc-test-link"] {
            assert!(at(name).exists(), "{name}");
        }
        drop(space);
        assert_eq!(sweep(KIND, place.path()), [at("coloc-test-lives")]);
    }
}
