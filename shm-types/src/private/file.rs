//! A file of this user's, at a name in a directory that is held open.
use std::ffi::OsString;
use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, FileType, Mode, OFlags, Stat};
use rustix::io::Errno;

use super::directory::check_owner;
use super::error::NotPrivate;
use super::walk::{Walk, stat};

/// A name where a file of ours is or will be. It is opened, made and replaced without following a link there.
#[derive(Debug)]
pub struct OwnFile {
    directory: OwnedFd,
    name: OsString,
    path: PathBuf,
    /// Below /proc a link is the thing itself.
    nofollow: OFlags,
}

/// Found and made by turns at most so often: somebody else may make and remove it meanwhile.
const ATTEMPTS: u32 = 10;

impl OwnFile {
    pub(super) fn below(directory: OwnedFd, name: OsString, path: PathBuf) -> Self {
        Self {
            directory,
            name,
            path,
            nofollow: OFlags::NOFOLLOW,
        }
    }

    /// The file at a path that a person named. Links are followed if this user, the superuser or the owner of the
    /// directory that they are in made them, so a log may be a link; the directory must be there.
    ///
    /// # Errors
    /// Each [`NotPrivate`] says what to do about it.
    pub fn named(path: &Path) -> Result<Self, NotPrivate> {
        let (walk, name) = Walk::to_file(path)?;
        let nofollow = if walk.is_below_proc() {
            OFlags::empty()
        } else {
            OFlags::NOFOLLOW
        };
        let path = walk.path.join(&name);
        Ok(Self {
            directory: walk.at,
            name,
            path,
            nofollow,
        })
    }

    /// Its path, without symbolic links.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The text in it, or `None` if it is not there. Only an ordinary file is read that nobody else can have written.
    ///
    /// # Errors
    /// Each [`NotPrivate`] says what to do about it; also if it is longer than `limit` bytes, or not text.
    pub fn read(&self, limit: u64) -> Result<Option<String>, NotPrivate> {
        let file = match self.open(OFlags::RDONLY) {
            Ok(file) => file,
            Err(Errno::NOENT) => return Ok(None),
            Err(error) => return Err(self.failed("open")(error)),
        };
        let found = self.check_ordinary(&file)?;
        let mode = found.st_mode & 0o7777;
        if mode & 0o022 != 0 {
            let path = self.path.clone();
            return Err(NotPrivate::OpenFile { path, mode });
        }
        self.read_all(&file, limit).map(Some)
    }

    fn read_all(&self, file: &File, limit: u64) -> Result<String, NotPrivate> {
        let mut text = String::new();
        file.take(limit.saturating_add(1))
            .read_to_string(&mut text)
            .map_err(NotPrivate::system("read", &self.path))?;
        if text.len() as u64 > limit {
            let path = self.path.clone();
            return Err(NotPrivate::TooLong { path, limit });
        }
        Ok(text)
    }

    /// Opens it to write behind its end; it is made with mode 0600 if it is not there. Devices and pipes will do as well.
    ///
    /// # Errors
    /// Each [`NotPrivate`] says what to do about it.
    pub fn append(&self) -> Result<File, NotPrivate> {
        self.open_or_make(OFlags::WRONLY | OFlags::APPEND, true)
    }

    /// Opens it to read and write, for locks and the like; it is made with mode 0600 if it is not there.
    ///
    /// # Errors
    /// Each [`NotPrivate`] says what to do about it.
    pub fn read_write(&self) -> Result<File, NotPrivate> {
        self.open_or_make(OFlags::RDWR, false)
    }

    /// Opens it to read and write if it is there.
    ///
    /// # Errors
    /// Each [`NotPrivate`] says what to do about it.
    pub fn existing(&self) -> Result<Option<File>, NotPrivate> {
        match self.open(OFlags::RDWR) {
            Ok(file) => self.check(file, false).map(Some),
            Err(Errno::NOENT) => Ok(None),
            Err(error) => Err(self.failed("open")(error)),
        }
    }

    /// Makes it, with mode 0600, to write to.
    ///
    /// # Errors
    /// If something is there already ([`NotPrivate::kind`] tells), and what the system says.
    pub fn create_new(&self) -> Result<File, NotPrivate> {
        self.make(OFlags::WRONLY).map_err(self.failed("make"))
    }

    /// Puts a file with `content` into its place. Whoever looks sees the old or the new one, also after a power cut.
    ///
    /// # Errors
    /// What the system says; the old file is then still whole, and nothing is left beside it.
    pub fn replace(&self, content: &[u8]) -> Result<(), NotPrivate> {
        self.check_replaceable()?;
        let new = self.beside(".new")?;
        // Left by a process that was killed meanwhile.
        new.remove()?;
        let mut file = new.create_new()?;
        let replaced = file
            .write_all(content)
            .and_then(|()| file.sync_all())
            .map_err(NotPrivate::system("write", &new.path))
            .and_then(|()| {
                rustix::fs::renameat(&self.directory, &new.name, &self.directory, &self.name)
                    .map_err(self.failed("replace"))
            });
        if replaced.is_err() {
            // What kept it from being written is the news.
            let _ = new.remove();
        }
        replaced?;
        self.sync_directory()
    }

    /// A device or a directory is not ours to take away: the superuser could.
    fn check_replaceable(&self) -> Result<(), NotPrivate> {
        let found = rustix::fs::statat(&self.directory, &self.name, AtFlags::SYMLINK_NOFOLLOW);
        match found.map(|found| FileType::from_raw_mode(found.st_mode)) {
            Ok(FileType::RegularFile | FileType::Symlink) | Err(Errno::NOENT) => Ok(()),
            Ok(_) => Err(NotPrivate::NotAFile {
                path: self.path.clone(),
            }),
            Err(error) => Err(self.failed("look at")(error)),
        }
    }

    /// Removes it if it is there.
    ///
    /// # Errors
    /// What the system says.
    pub fn remove(&self) -> Result<(), NotPrivate> {
        match rustix::fs::unlinkat(&self.directory, &self.name, AtFlags::empty()) {
            Ok(()) | Err(Errno::NOENT) => Ok(()),
            Err(error) => Err(self.failed("remove")(error)),
        }
    }

    fn beside(&self, suffix: &str) -> Result<Self, NotPrivate> {
        let mut name = self.name.clone();
        name.push(suffix);
        let path = self.path.with_file_name(&name);
        let directory = self
            .directory
            .try_clone()
            .map_err(NotPrivate::system("open", &path))?;
        Ok(Self::below(directory, name, path))
    }

    fn sync_directory(&self) -> Result<(), NotPrivate> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
        match rustix::fs::openat(&self.directory, c".", flags, Mode::empty()) {
            Ok(directory) => rustix::fs::fsync(directory).map_err(self.failed("save")),
            // Who may write to a directory but not read it cannot do better.
            Err(Errno::ACCESS) => Ok(()),
            Err(error) => Err(self.failed("save")(error)),
        }
    }

    /// Never waits, not even for the reader of a pipe.
    fn open(&self, access: OFlags) -> Result<File, Errno> {
        let flags = access | self.nofollow | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
        let fd = rustix::fs::openat(&self.directory, &self.name, flags, Mode::empty())?;
        rustix::fs::fcntl_setfl(&fd, rustix::fs::fcntl_getfl(&fd)? - OFlags::NONBLOCK)?;
        Ok(fd.into())
    }

    fn make(&self, access: OFlags) -> Result<File, Errno> {
        let mode = Mode::RUSR | Mode::WUSR;
        let flags = access | OFlags::CREATE | OFlags::EXCL | OFlags::CLOEXEC;
        let fd = rustix::fs::openat(&self.directory, &self.name, flags, mode)?;
        // The umask may have taken more away, or the directory's access list given more.
        rustix::fs::fchmod(&fd, mode)?;
        Ok(fd.into())
    }

    fn failed(&self, action: &'static str) -> impl FnOnce(Errno) -> NotPrivate {
        NotPrivate::system(action, &self.path)
    }

    fn open_or_make(&self, access: OFlags, any_kind: bool) -> Result<File, NotPrivate> {
        let mut last = Errno::NOENT;
        for _ in 0..ATTEMPTS {
            let result = match self.open(access) {
                Err(Errno::NOENT) => self.make(access),
                Ok(file) => return self.check(file, any_kind),
                Err(error) => Err(error),
            };
            match result {
                Err(error @ Errno::EXIST) => last = error,
                result => return result.map_err(self.failed("open")),
            }
        }
        Err(self.failed("open")(last))
    }

    fn check(&self, file: File, any_kind: bool) -> Result<File, NotPrivate> {
        let kind = FileType::from_raw_mode(stat(&file, &self.path)?.st_mode);
        if any_kind && !matches!(kind, FileType::RegularFile | FileType::Directory) {
            return Ok(file);
        }
        self.check_ordinary(&file)?;
        Ok(file)
    }

    fn check_ordinary(&self, file: &File) -> Result<Stat, NotPrivate> {
        let found = stat(file, &self.path)?;
        let path = self.path.clone();
        if FileType::from_raw_mode(found.st_mode) != FileType::RegularFile {
            return Err(NotPrivate::NotAFile { path });
        }
        check_owner(&found, &path)?;
        if found.st_nlink > 1 {
            let links = found.st_nlink;
            return Err(NotPrivate::ManyNames { path, links });
        }
        Ok(found)
    }
}
