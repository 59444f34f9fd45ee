//! A mapped file in `/dev/shm`.
#![expect(unsafe_code, reason = "memory that other processes map as well")]

use std::os::fd::{AsFd, BorrowedFd};
use std::path::{Path, PathBuf};
use std::ptr::NonNull;

use iceoryx2_bb_posix::access_mode::AccessMode;
use iceoryx2_cal::named_concept::FileName;
use rustix::fs::{AtFlags, CWD, FallocateFlags, FileType, Gid, Mode, OFlags};
use rustix::io::Errno;
use rustix::mm::{MapFlags, ProtFlags};

use super::unfinished::Unfinished;

/// Where the C library's `shm_open` looks.
pub(crate) const DIRECTORY: &str = "/dev/shm";

const PRIVATE: Mode = Mode::RUSR.union(Mode::WUSR);
const READABLE: Mode = PRIVATE.union(Mode::RGRP);
/// What more than that is allowed, nobody has set who is to be believed.
const OPEN: Mode = Mode::WGRP.union(Mode::XGRP).union(Mode::RWXO);

/// Why a segment is not opened.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// There is none.
    Missing,
    /// It is not complete, and will never be if its maker is dead.
    HalfMade,
    /// It is another user's, or no file at all.
    NotOurs,
    /// The kernel said no.
    System(Errno),
}

/// Memory that is there to the last byte for as long as this lives.
#[derive(Debug)]
pub(crate) struct Segment {
    base: NonNull<u8>,
    length: usize,
    /// Device and inode.
    identity: (u64, u64),
}

// SAFETY: an address range belongs to the process, not to a thread; what may be done with its bytes is its users' concern.
unsafe impl Send for Segment {}
// SAFETY: as above.
unsafe impl Sync for Segment {}

impl Segment {
    /// Maps what has this name, at once or not at all.
    pub(crate) fn open(name: &FileName, access: AccessMode) -> Result<Self, Refusal> {
        // Not waiting either for whoever looks whether it is dead.
        let flags = OFlags::RDWR | OFlags::CLOEXEC | OFlags::NOFOLLOW | OFlags::NONBLOCK;
        let file = rustix::fs::open(path(name), flags, Mode::empty()).map_err(refusal)?;
        let length = check(file.as_fd())?;
        // Other makers leave holes, which would be filled when they are touched, or end the process.
        reserve(file.as_fd(), length).map_err(Refusal::System)?;
        Self::map(file.as_fd(), length, protection(access)).map_err(Refusal::System)
    }

    /// Maps the file of the user `owner` at `path`, to read: its owner may have opened it to a group, and to nobody else.
    pub(crate) fn open_to_read(path: &Path, owner: u32) -> Result<Self, Refusal> {
        let flags = OFlags::RDONLY | OFlags::CLOEXEC | OFlags::NOFOLLOW | OFlags::NONBLOCK;
        let file = rustix::fs::open(path, flags, Mode::empty()).map_err(Refusal::System)?;
        let length = check_foreign(file.as_fd(), owner)?;
        Self::map(file.as_fd(), length, ProtFlags::READ).map_err(Refusal::System)
    }

    pub(crate) fn base(&self) -> NonNull<u8> {
        self.base
    }

    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// Whether the file at `path` is this one.
    pub(super) fn is_at(&self, path: &Path) -> bool {
        let found = rustix::fs::statat(CWD, path, AtFlags::SYMLINK_NOFOLLOW);
        found.is_ok_and(|found| (found.st_dev, found.st_ino) == self.identity)
    }

    fn map(file: BorrowedFd<'_>, length: usize, access: ProtFlags) -> Result<Self, Errno> {
        let found = rustix::fs::fstat(file)?;
        // SAFETY: the kernel chooses a range that nothing else uses.
        let base = unsafe {
            rustix::mm::mmap(
                std::ptr::null_mut(),
                length,
                access,
                MapFlags::SHARED,
                file,
                0,
            )?
        };
        let base = NonNull::new(base.cast()).ok_or(Errno::NOMEM)?;
        Ok(Self {
            base,
            length,
            identity: (found.st_dev, found.st_ino),
        })
    }
}

impl Drop for Segment {
    fn drop(&mut self) {
        // SAFETY: the range is the one that was mapped, and whoever used it borrowed this.
        let _ = unsafe { rustix::mm::munmap(self.base.as_ptr().cast(), self.length) };
    }
}

/// A segment that nobody finds yet.
#[derive(Debug)]
pub(crate) struct Draft {
    segment: Segment,
    file: Unfinished,
}

impl Draft {
    /// Reserves `length` bytes, all zero.
    pub(crate) fn new(name: &FileName, length: usize) -> Result<Self, Errno> {
        let file = Unfinished::new(path(name))?;
        reserve(file.as_fd(), length)?;
        let segment = Segment::map(file.as_fd(), length, protection(AccessMode::ReadWrite))?;
        Ok(Self { segment, file })
    }

    pub(crate) fn segment(&self) -> &Segment {
        &self.segment
    }

    /// Lets everybody find it, unless there is something of its name.
    pub(crate) fn publish(self) -> Result<Segment, (Self, Errno)> {
        self.publish_with(PRIVATE)
    }

    /// The same, for the users of `group` to read.
    pub(crate) fn publish_to(self, group: u32) -> Result<Segment, (Self, Errno)> {
        match rustix::fs::fchown(self.file.as_fd(), None, Some(Gid::from_raw(group))) {
            Ok(()) => self.publish_with(READABLE),
            Err(error) => Err((self, error)),
        }
    }

    fn publish_with(self, mode: Mode) -> Result<Segment, (Self, Errno)> {
        match self.file.publish(mode) {
            Ok(()) => Ok(self.segment),
            Err(error) => Err((self, error)),
        }
    }
}

pub(super) fn path(name: &FileName) -> PathBuf {
    Path::new(DIRECTORY).join(name.to_string())
}

fn protection(access: AccessMode) -> ProtFlags {
    match access {
        AccessMode::Read => ProtFlags::READ,
        _ => ProtFlags::READ | ProtFlags::WRITE,
    }
}

/// Makes the file so long, and every page of it present.
fn reserve(file: BorrowedFd<'_>, length: usize) -> Result<(), Errno> {
    let length = length as u64;
    rustix::io::retry_on_intr(|| rustix::fs::fallocate(file, FallocateFlags::empty(), 0, length))
}

/// How long the file is, if it is complete and ours.
fn check(file: BorrowedFd<'_>) -> Result<usize, Refusal> {
    let found = rustix::fs::fstat(file).map_err(Refusal::System)?;
    let regular = FileType::from_raw_mode(found.st_mode) == FileType::RegularFile;
    if !regular || found.st_uid != rustix::process::geteuid().as_raw() {
        return Err(Refusal::NotOurs);
    }
    // Makers of other programs let it be read when it is complete; the superuser could read it before.
    if !Mode::from_raw_mode(found.st_mode).contains(PRIVATE) {
        return Err(Refusal::HalfMade);
    }
    match usize::try_from(found.st_size) {
        Ok(0) | Err(_) => Err(Refusal::HalfMade),
        Ok(length) => Ok(length),
    }
}

fn check_foreign(file: BorrowedFd<'_>, owner: u32) -> Result<usize, Refusal> {
    let found = rustix::fs::fstat(file).map_err(Refusal::System)?;
    let regular = FileType::from_raw_mode(found.st_mode) == FileType::RegularFile;
    let open = Mode::from_raw_mode(found.st_mode).intersects(OPEN);
    if !regular || open || found.st_uid != owner {
        return Err(Refusal::NotOurs);
    }
    usize::try_from(found.st_size).map_err(|_| Refusal::HalfMade)
}

fn refusal(error: Errno) -> Refusal {
    match error {
        Errno::NOENT => Refusal::Missing,
        Errno::ACCESS => Refusal::HalfMade,
        Errno::LOOP => Refusal::NotOurs,
        error => Refusal::System(error),
    }
}
