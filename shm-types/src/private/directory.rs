//! A directory for this user alone, held open.
use std::ffi::{OsStr, OsString};
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, Dir, FileType, Mode, OFlags, Stat};
use rustix::io::Errno;

use super::error::NotPrivate;
use super::file::OwnFile;
use super::own_user;
use super::owner::{self, HANDLE};
use super::walk::{Goal, Walk, stat};

const READ: OFlags = OFlags::RDONLY
    .union(OFlags::DIRECTORY)
    .union(OFlags::NOFOLLOW)
    .union(OFlags::CLOEXEC);

/// A directory of mode 0700 that belongs to this user and that nobody else can exchange.
#[derive(Debug)]
pub struct PrivateDirectory {
    fd: OwnedFd,
    path: PathBuf,
    former_mode: Option<u32>,
}

impl PrivateDirectory {
    /// The directory at `path`, which is made if it is not there, with those above it.
    ///
    /// If it is there, ours and open to others it is closed, provided that everything in it is ours and `belongs`
    /// there: a directory for other things is left as it is.
    ///
    /// # Errors
    /// Each [`NotPrivate`] says what to do about it.
    pub fn make(path: &Path, belongs: impl Fn(&OsStr) -> bool) -> Result<Self, NotPrivate> {
        Self::reach(path, Goal::NewDirectory, belongs)
    }

    /// Like [`Self::make`], for one that is there.
    ///
    /// # Errors
    /// As [`Self::make`]; [`NotPrivate::kind`] tells a missing one.
    pub fn open(path: &Path, belongs: impl Fn(&OsStr) -> bool) -> Result<Self, NotPrivate> {
        Self::reach(path, Goal::Directory, belongs)
    }

    fn reach(
        path: &Path,
        goal: Goal,
        belongs: impl Fn(&OsStr) -> bool,
    ) -> Result<Self, NotPrivate> {
        let reached = Walk::to_directory(path, goal)?;
        Self::of(&reached.at, reached.path, belongs)
    }

    fn check(
        above: BorrowedFd<'_>,
        name: &[u8],
        path: PathBuf,
        belongs: impl Fn(&OsStr) -> bool,
    ) -> Result<Self, NotPrivate> {
        let handle = rustix::fs::openat(above, name, HANDLE, Mode::empty())
            .map_err(NotPrivate::system("open", &path))?;
        Self::of(&handle, path, belongs)
    }

    /// What was found at the end of the way.
    fn of(
        handle: &OwnedFd,
        path: PathBuf,
        belongs: impl Fn(&OsStr) -> bool,
    ) -> Result<Self, NotPrivate> {
        let found = stat(handle, &path)?;
        check_owner(&found, &path)?;
        let was_shut = owner::let_in(handle, &found, &path)?;
        let fd = rustix::fs::openat(handle, c".", READ, Mode::empty())
            .map_err(NotPrivate::system("open", &path))?;
        let mut directory = Self {
            fd,
            path,
            former_mode: None,
        };
        let mode = found.st_mode & 0o7777;
        if mode != 0o700
            && let Err(refusal) = directory.close(mode, belongs)
        {
            if was_shut {
                // One for other things is left as it was; if that fails, its owner has more rights than before.
                let _ = owner::set_mode(handle, Mode::from_raw_mode(mode));
            }
            return Err(refusal);
        }
        Ok(directory)
    }

    /// What is in it is looked at again once nobody else can add to it.
    fn close(&mut self, mode: u32, belongs: impl Fn(&OsStr) -> bool) -> Result<(), NotPrivate> {
        self.check_entries(mode, &belongs)?;
        rustix::fs::fchmod(&self.fd, Mode::RWXU)
            .map_err(NotPrivate::system("close (chmod 700)", &self.path))?;
        let now = stat(&self.fd, &self.path)?.st_mode & 0o7777;
        if now != 0o700 {
            return Err(NotPrivate::CannotClose {
                path: self.path.clone(),
                mode: now,
            });
        }
        // A directory of a moment ago whose mode the umask or its parent made different was never open.
        self.former_mode = (mode & 0o077 != 0).then_some(mode);
        self.check_entries(mode, &belongs)
    }

    fn check_entries(
        &self,
        mode: u32,
        belongs: &impl Fn(&OsStr) -> bool,
    ) -> Result<(), NotPrivate> {
        for entry in self.entries()? {
            let owner = self.owner(&entry)?;
            if owner.is_some_and(|owner| owner != own_user()) || !belongs(&entry) {
                return Err(NotPrivate::Foreign {
                    path: self.path.clone(),
                    mode,
                    entry: entry.to_string_lossy().into_owned(),
                });
            }
        }
        Ok(())
    }

    /// Whose the entry is, without following it; `None` if it is gone.
    fn owner(&self, entry: &OsStr) -> Result<Option<u32>, NotPrivate> {
        match rustix::fs::statat(&self.fd, entry, AtFlags::SYMLINK_NOFOLLOW) {
            Ok(stat) => Ok(Some(stat.st_uid)),
            Err(Errno::NOENT) => Ok(None),
            Err(error) => Err(NotPrivate::system("look at", &self.path.join(entry))(error)),
        }
    }

    /// The directory `name` in it, which is made if it is not there. `name` is one name, not a path.
    ///
    /// # Errors
    /// As [`Self::make`].
    pub fn subdirectory(&self, name: &str) -> Result<Self, NotPrivate> {
        let path = self.path.join(name);
        match rustix::fs::mkdirat(&self.fd, name, Mode::RWXU) {
            Ok(()) | Err(Errno::EXIST) => {}
            Err(error) => return Err(NotPrivate::system("make the directory", &path)(error)),
        }
        Self::check(self.fd.as_fd(), name.as_bytes(), path, |_| true)
    }

    /// Lets its owner into the directory `name` in it, if that is there and shut to everybody.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn unlock(&self, name: &str) -> Result<(), NotPrivate> {
        let path = self.path.join(name);
        match rustix::fs::openat(&self.fd, name, HANDLE, Mode::empty()) {
            Ok(handle) => owner::let_in(&handle, &stat(&handle, &path)?, &path).map(drop),
            Err(Errno::NOENT | Errno::NOTDIR | Errno::LOOP) => Ok(()),
            Err(error) => Err(NotPrivate::system("open", &path)(error)),
        }
    }

    /// The file `name` in it, which need not be there. `name` is one name, not a path.
    ///
    /// # Errors
    /// If the process has no descriptors left.
    pub fn file(&self, name: &str) -> Result<OwnFile, NotPrivate> {
        let path = self.path.join(name);
        let directory = self
            .fd
            .try_clone()
            .map_err(NotPrivate::system("open", &path))?;
        Ok(OwnFile::below(directory, name.into(), path))
    }

    /// Its path, without symbolic links.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The mode that it had when it was found open to others, and closed.
    #[must_use]
    pub fn former_mode(&self) -> Option<u32> {
        self.former_mode
    }

    /// Names of what is in it.
    ///
    /// # Errors
    /// What the system says.
    pub fn entries(&self) -> Result<Vec<OsString>, NotPrivate> {
        entries(self.fd.as_fd()).map_err(NotPrivate::system("list", &self.path))
    }

    /// Removes the file or the whole directory `name`, if it is there; no link is followed.
    ///
    /// # Errors
    /// What the system says.
    pub fn remove(&self, name: &OsStr) -> Result<(), NotPrivate> {
        let path = self.path.join(name);
        remove(self.fd.as_fd(), name, &path).map_err(NotPrivate::system("remove", &path))
    }

    /// Whether its path still leads to it: it may have been deleted or exchanged.
    #[must_use]
    pub fn is_in_place(&self) -> bool {
        let (Ok(own), Ok(found)) = (rustix::fs::fstat(&self.fd), rustix::fs::lstat(&self.path))
        else {
            return false;
        };
        (own.st_dev, own.st_ino) == (found.st_dev, found.st_ino)
    }
}

impl AsFd for PrivateDirectory {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }
}

pub(super) fn check_owner(found: &Stat, path: &Path) -> Result<(), NotPrivate> {
    let (owner, own) = (found.st_uid, own_user());
    if owner == own {
        return Ok(());
    }
    Err(NotPrivate::WrongUser {
        path: path.into(),
        owner,
        own,
    })
}

fn entries(directory: BorrowedFd<'_>) -> io::Result<Vec<OsString>> {
    let mut names = Vec::new();
    for entry in Dir::read_from(directory)? {
        let entry = entry?;
        let name = entry.file_name().to_bytes();
        if name != b"." && name != b".." {
            names.push(OsStr::from_bytes(name).to_owned());
        }
    }
    Ok(names)
}

fn remove(above: BorrowedFd<'_>, name: &OsStr, path: &Path) -> io::Result<()> {
    let kind = match rustix::fs::statat(above, name, AtFlags::SYMLINK_NOFOLLOW) {
        Ok(stat) => FileType::from_raw_mode(stat.st_mode),
        Err(error) => return if_there(Err(error)),
    };
    if kind != FileType::Directory {
        return if_there(rustix::fs::unlinkat(above, name, AtFlags::empty()));
    }
    let handle = rustix::fs::openat(above, name, HANDLE, Mode::empty())?;
    owner::let_in(&handle, &rustix::fs::fstat(&handle)?, path)?;
    let directory = rustix::fs::openat(&handle, c".", READ, Mode::empty())?;
    for entry in entries(directory.as_fd())? {
        remove(directory.as_fd(), &entry, &path.join(&entry))?;
    }
    if_there(rustix::fs::unlinkat(above, name, AtFlags::REMOVEDIR))
}

/// Another process may have been faster.
fn if_there(result: Result<(), Errno>) -> io::Result<()> {
    match result {
        Err(Errno::NOENT) => Ok(()),
        result => Ok(result?),
    }
}
