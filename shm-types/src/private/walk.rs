//! From the root of the file system to a place, one name after another.
use std::ffi::{OsStr, OsString};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Component, Path, PathBuf};

use rustix::fs::{FileType, Mode, OFlags, Stat};
use rustix::io::Errno;

use super::error::NotPrivate;
use super::own_user;
use super::owner::{self, HANDLE};

/// As many as the kernel follows.
const MOST_LINKS: u32 = 40;

/// Enough to go on from, not to read.
const STEP: OFlags = OFlags::PATH.union(OFlags::NOFOLLOW).union(OFlags::CLOEXEC);

/// What is to be reached, and what is allowed on the way.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Goal {
    /// A directory whose place nobody else can take.
    Directory,
    /// The same, made if it is missing.
    NewDirectory,
    /// A file that a person named, wherever that is.
    File,
}

/// Where the way has led so far.
#[derive(Debug)]
pub(super) struct Walk {
    wanted: PathBuf,
    goal: Goal,
    /// Opened with `O_PATH`.
    pub(super) at: OwnedFd,
    /// The same as text, without links.
    pub(super) path: PathBuf,
    /// Names to go, the next one last.
    ahead: Vec<OsString>,
    links: u32,
}

impl Walk {
    fn start(wanted: &Path, goal: Goal) -> Result<Self, NotPrivate> {
        let absolute = std::path::absolute(wanted).map_err(NotPrivate::system("find", wanted))?;
        let mut walk = Self {
            wanted: wanted.into(),
            goal,
            at: open_root(wanted)?,
            path: "/".into(),
            ahead: Vec::new(),
            links: 0,
        };
        walk.add(&absolute)?;
        Ok(walk)
    }

    /// The directory at `wanted`.
    pub(super) fn to_directory(wanted: &Path, goal: Goal) -> Result<Self, NotPrivate> {
        let mut walk = Self::start(wanted, goal)?;
        while let Some(name) = walk.ahead.pop() {
            walk.step(&name)?;
        }
        Ok(walk)
    }

    /// The directory of the file at `wanted`, and the file's name there; a link in its place has been followed.
    pub(super) fn to_file(wanted: &Path) -> Result<(Self, OsString), NotPrivate> {
        let mut walk = Self::start(wanted, Goal::File)?;
        while let Some(name) = walk.ahead.pop() {
            if !walk.ahead.is_empty() || walk.is_plain_link(&name)? {
                walk.step(&name)?;
            } else if name != ".." {
                return Ok((walk, name));
            }
        }
        Err(NotPrivate::NotAFile {
            path: wanted.into(),
        })
    }

    /// Links below /proc lead to what has no name; the kernel follows them.
    fn is_plain_link(&self, name: &OsStr) -> Result<bool, NotPrivate> {
        match rustix::fs::statat(&self.at, name, rustix::fs::AtFlags::SYMLINK_NOFOLLOW) {
            Ok(stat) => Ok(is_link(&stat) && !self.is_below_proc()),
            Err(Errno::NOENT) => Ok(false),
            Err(error) => Err(self.failed("look at", name)(error)),
        }
    }

    pub(super) fn is_below_proc(&self) -> bool {
        const PROC_SUPER_MAGIC: u64 = 0x9fa0;
        rustix::fs::fstatfs(&self.at)
            .is_ok_and(|fs| u64::try_from(fs.f_type) == Ok(PROC_SUPER_MAGIC))
    }

    /// Puts what `path` consists of in front of what is to go.
    fn add(&mut self, path: &Path) -> Result<(), NotPrivate> {
        for component in path.components().rev() {
            match component {
                Component::RootDir => (self.at, self.path) = (open_root(path)?, "/".into()),
                Component::ParentDir => self.ahead.push("..".into()),
                Component::Normal(name) => self.ahead.push(name.into()),
                Component::CurDir | Component::Prefix(_) => {}
            }
        }
        Ok(())
    }

    fn step(&mut self, name: &OsStr) -> Result<(), NotPrivate> {
        let parent = stat(&self.at, &self.path)?;
        if self.goal != Goal::File {
            self.check_parent(&parent)?;
        }
        let next = self.open(name)?;
        let there = self.path.join(name);
        let found = stat(&next, &there)?;
        if is_link(&found) {
            return self.follow(&next, &there, &found, &parent);
        }
        if FileType::from_raw_mode(found.st_mode) != FileType::Directory {
            return Err(NotPrivate::NotADirectory { path: there });
        }
        if name == ".." {
            self.path.pop();
        } else {
            self.path = there;
        }
        self.at = next;
        Ok(())
    }

    fn open(&self, name: &OsStr) -> Result<OwnedFd, NotPrivate> {
        let open = || rustix::fs::openat(&self.at, name, STEP, Mode::empty());
        let result = match open() {
            Err(Errno::NOENT) if self.goal == Goal::NewDirectory => {
                self.make(name)?;
                open()
            }
            result => result,
        };
        result.map_err(self.failed("open", name))
    }

    fn make(&self, name: &OsStr) -> Result<(), NotPrivate> {
        match rustix::fs::mkdirat(&self.at, name, Mode::RWXU) {
            Ok(()) => self.let_in(name),
            Err(Errno::EXIST) => Ok(()),
            Err(error) => Err(self.failed("make the directory", name)(error)),
        }
    }

    /// A umask can shut even its maker out.
    fn let_in(&self, name: &OsStr) -> Result<(), NotPrivate> {
        let made = rustix::fs::openat(&self.at, name, HANDLE, Mode::empty())
            .map_err(self.failed("open", name))?;
        let path = self.path.join(name);
        owner::let_in(&made, &stat(&made, &path)?, &path).map(drop)
    }

    fn follow(
        &mut self,
        link: &OwnedFd,
        there: &Path,
        found: &Stat,
        parent: &Stat,
    ) -> Result<(), NotPrivate> {
        if !is_trusted(found.st_uid) && found.st_uid != parent.st_uid {
            return Err(NotPrivate::StrangersLink {
                path: there.into(),
                owner: found.st_uid,
            });
        }
        self.links += 1;
        if self.links > MOST_LINKS {
            return Err(NotPrivate::system("follow", there)(Errno::LOOP));
        }
        let target = rustix::fs::readlinkat(link, c"", Vec::new())
            .map_err(NotPrivate::system("read the link", there))?;
        self.add(Path::new(OsStr::from_bytes(target.to_bytes())))
    }

    /// Nobody else may put something else into the place of what is in there.
    fn check_parent(&self, parent: &Stat) -> Result<(), NotPrivate> {
        if !is_trusted(parent.st_uid) {
            return Err(NotPrivate::StrangersParent {
                path: self.wanted.clone(),
                parent: self.path.clone(),
                owner: parent.st_uid,
            });
        }
        let mode = Mode::from_raw_mode(parent.st_mode);
        // The groups of this process and of the superuser are as good as their users.
        let own_group = [0, rustix::process::getegid().as_raw()].contains(&parent.st_gid);
        let open = mode.contains(Mode::WOTH) || mode.contains(Mode::WGRP) && !own_group;
        // In a sticky directory only who owns something can rename it.
        if open && !mode.contains(Mode::SVTX) {
            return Err(NotPrivate::OpenParent {
                path: self.wanted.clone(),
                parent: self.path.clone(),
                mode: parent.st_mode & 0o7777,
            });
        }
        Ok(())
    }

    fn failed(&self, action: &'static str, name: &OsStr) -> impl FnOnce(Errno) -> NotPrivate {
        let path = self.path.join(name);
        move |error| NotPrivate::system(action, &path)(error)
    }
}

fn open_root(wanted: &Path) -> Result<OwnedFd, NotPrivate> {
    rustix::fs::open("/", STEP | OFlags::DIRECTORY, Mode::empty())
        .map_err(NotPrivate::system("find", wanted))
}

pub(super) fn stat(fd: &impl AsFd, path: &Path) -> Result<Stat, NotPrivate> {
    rustix::fs::fstat(fd).map_err(NotPrivate::system("look at", path))
}

fn is_link(stat: &Stat) -> bool {
    FileType::from_raw_mode(stat.st_mode) == FileType::Symlink
}

fn is_trusted(user: u32) -> bool {
    user == own_user() || user == 0 || is_outside(user)
}

/// Whether `user` stands for everybody whom this process's user namespace does not know: there the superuser is one of
/// them, and nobody inside can be told from them or harm what is theirs.
fn is_outside(user: u32) -> bool {
    const OVERFLOW: u32 = 65534;
    user == OVERFLOW
        && std::fs::read_to_string("/proc/self/uid_map").is_ok_and(|map| !is_mapped(&map, OVERFLOW))
}

fn is_mapped(map: &str, user: u32) -> bool {
    map.lines().any(|line| {
        let mut numbers = line.split_whitespace().map(str::parse::<u64>);
        match (numbers.next(), numbers.nth(1)) {
            (Some(Ok(first)), Some(Ok(count))) => (first..first + count).contains(&u64::from(user)),
            _ => false,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_map_without_the_user_leaves_it_outside() {
        assert!(is_mapped("         0          0 4294967295\n", 65534));
        assert!(is_mapped("0 100000 65536\n", 65534));
        assert!(!is_mapped("0 1000 1\n", 65534));
        assert!(!is_mapped("0 1000 1\n1 100000 1000\n", 65534));
    }
}
