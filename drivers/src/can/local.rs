//! A bus between processes of one machine, without CAN in the kernel: a directory of Unix datagram sockets.
//!
//! Every participant that listens binds one socket in the directory; a sender sends the raw bytes of a frame
//! (see [`super::Frame`]) to every socket there. The kernel stamps the datagrams on arrival as it stamps CAN frames,
//! and filters them by identifier before they wake anybody (classic BPF, since Unix sockets know no CAN filters).
//!
//! The kernel queues `net.unix.max_dgram_qlen` + 1 datagrams a socket (11 where the limit is the kernel's own, 513 under
//! systemd) and makes the sender lose what comes on top, whatever the buffer sizes say. Because of the filter only wanted
//! frames count: two a tick leave a daemon five ticks of slack. Cumulative encoder counters lose nothing even beyond.

use std::ffi::{CStr, CString, OsStr};
use std::io::{self, Write};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use coloc_shm_types::private::{NotPrivate, PrivateDirectory, unguessable};
use rustix::fs::{FileType, Mode, OFlags, RawDir, Stat};
use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, bind, socket_with};

use super::filter::Filter;
use super::health::BusState;
use super::peers::bury_the_dead;
use super::room::Limit;
use super::socket_bus::Endpoint;
use super::socketcan::ON;
use super::sys;

/// A participant that listens: its socket's place and filter, prepared once.
#[derive(Debug)]
pub(super) struct Participant {
    directory: CString,
    /// One name below it.
    name: String,
    path: CString,
    /// Whose all of it is.
    user: u32,
    program: Option<Vec<libc::sock_filter>>,
}

/// Longest path of a socket, with the zero behind it.
const LONGEST_PATH: usize = 108;

/// Tells the participants of one process apart.
static PARTICIPANTS: AtomicU32 = AtomicU32::new(0);

impl Participant {
    /// Takes a name of its own in `directory`, which is made if it is not there. Containers may share the directory, so
    /// the process's number is not enough.
    pub(super) fn new(directory: &Path, filter: &Filter) -> io::Result<Self> {
        let directory = PrivateDirectory::make(directory, may_be_ours)?;
        bury_the_dead(directory.path());
        let (process, number) = (
            std::process::id(),
            PARTICIPANTS.fetch_add(1, Ordering::Relaxed),
        );
        let name = format!("{process}-{number}-{:08x}", unguessable()? >> 32);
        let path = directory.path().join(&name);
        // Whoever sends there needs a path that fits.
        SocketAddrUnix::new(&path)?;
        Ok(Self {
            directory: CString::new(directory.path().as_os_str().as_bytes())?,
            path: CString::new(path.as_os_str().as_bytes())?,
            name,
            user: own_user(),
            program: filter.bpf_program(),
        })
    }

    /// Others made what is not ours or lets others in; one of ours that was made anew is closed. No allocation.
    fn open_directory(&self) -> Result<OwnedFd, Errno> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let directory = rustix::fs::open(self.directory.as_c_str(), flags, Mode::empty())?;
        let found = rustix::fs::fstat(&directory)?;
        if found.st_uid != self.user {
            return Err(Errno::NOENT);
        }
        if found.st_mode & 0o077 != 0 {
            rustix::fs::fchmod(&directory, Mode::RWXU)?;
        }
        Ok(directory)
    }
}

impl Endpoint for Participant {
    fn open(&self) -> Result<OwnedFd, Errno> {
        let socket = datagram_socket()?;
        let fd = socket.as_fd();
        if let Some(program) = &self.program {
            sys::attach_filter(fd, program)?;
        }
        sys::set_option(fd, libc::SOL_SOCKET, libc::SO_TIMESTAMPNS, &[ON])?;
        let directory = self.open_directory()?;
        // Left by our own socket before it was lost.
        let _ = rustix::fs::unlinkat(&directory, self.name.as_str(), rustix::fs::AtFlags::empty());
        bind(fd, &address_below(&directory, &self.name)?)?;
        Ok(socket)
    }

    fn state(&self, _: BorrowedFd<'_>) -> BusState {
        match rustix::fs::lstat(self.path.as_c_str()) {
            Ok(found) if found.st_uid == self.user && is_socket(&found) => BusState::Up,
            _ => BusState::Gone,
        }
    }

    /// The kernel's limit when the socket was made is all that counts; what is kept takes memory of the sender.
    fn keep(&self, _: BorrowedFd<'_>, _: usize) -> Result<usize, Errno> {
        queue_length()
    }

    const LIMIT: Limit = Limit::Datagrams;
}

/// So many datagrams wait for a Unix socket that is made now. No allocation.
fn queue_length() -> Result<usize, Errno> {
    let flags = OFlags::RDONLY | OFlags::CLOEXEC;
    let file = rustix::fs::open(c"/proc/sys/net/unix/max_dgram_qlen", flags, Mode::empty())?;
    let mut text = [0; 24];
    let length = rustix::io::read(&file, &mut text)?;
    let text = text
        .get(..length)
        .and_then(|text| str::from_utf8(text).ok());
    let limit: usize = text
        .and_then(|text| text.trim().parse().ok())
        .ok_or(Errno::INVAL)?;
    Ok(limit.saturating_add(1))
}

impl Drop for Participant {
    fn drop(&mut self) {
        // It may be gone already, with the directory; there is nobody left to tell.
        let _ = rustix::fs::unlink(self.path.as_c_str());
    }
}

/// Directories that somebody uses for something else are not closed.
fn may_be_ours(name: &std::ffi::OsStr) -> bool {
    let bytes = name.as_bytes();
    bytes
        .iter()
        .all(|byte| byte.is_ascii_hexdigit() || *byte == b'-')
}

/// A bus's directory, as its senders look into it again and again.
#[derive(Debug)]
pub(super) struct Directory {
    path: CString,
    /// Whose all of it is.
    user: u32,
}

/// What the kernel tells of a directory at once \[bytes\].
const ENTRIES: usize = 2048;

impl Directory {
    pub(super) fn new(path: &Path) -> io::Result<Self> {
        Ok(Self {
            path: CString::new(path.as_os_str().as_bytes())?,
            user: own_user(),
        })
    }

    /// The places of those who listen, as [`listeners`] finds them. No allocation, but where the directory has to be closed first.
    pub(super) fn each_listener(&self, tell: &mut impl FnMut(SocketAddrUnix)) -> Result<(), Errno> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
        let directory = rustix::fs::open(self.path.as_c_str(), flags, Mode::empty())?;
        let found = rustix::fs::fstat(&directory)?;
        if found.st_uid != self.user {
            return Err(Errno::NOENT);
        }
        if found.st_mode & 0o077 != 0 {
            listeners(Path::new(OsStr::from_bytes(self.path.to_bytes())))
                .map_err(|_| Errno::NOENT)?;
        }
        let mut buffer = [MaybeUninit::uninit(); ENTRIES];
        let mut entries = RawDir::new(&directory, &mut buffer);
        while let Some(entry) = entries.next() {
            let entry = entry?;
            let name = entry.file_name();
            let flags = rustix::fs::AtFlags::SYMLINK_NOFOLLOW;
            let is_own = rustix::fs::statat(&directory, name, flags)
                .is_ok_and(|it| it.st_uid == self.user && is_socket(&it));
            if is_own && let Ok(address) = self.address_of(name) {
                tell(address);
            }
        }
        Ok(())
    }

    fn address_of(&self, name: &CStr) -> Result<SocketAddrUnix, Errno> {
        let mut path = [0; LONGEST_PATH];
        let mut rest = path.as_mut_slice();
        let parts = [self.path.to_bytes(), b"/", name.to_bytes_with_nul()];
        for part in parts {
            rest.write_all(part).map_err(|_| Errno::NAMETOOLONG)?;
        }
        let path = CStr::from_bytes_until_nul(&path).map_err(|_| Errno::NAMETOOLONG)?;
        SocketAddrUnix::new(path)
    }
}

/// The sockets of those who listen; none if there is no directory, or not ours alone.
///
/// What a stranger left there before it was closed is not spoken to.
pub(super) fn listeners(directory: &Path) -> Result<Vec<std::path::PathBuf>, NotPrivate> {
    let directory = PrivateDirectory::open(directory, may_be_ours)?;
    let mut paths: Vec<_> = directory
        .entries()?
        .into_iter()
        .map(|name| directory.path().join(name))
        .collect();
    // A file of another kind refuses connections like a dead socket does, but is not ours to bury.
    let own = own_user();
    paths.retain(|path| rustix::fs::lstat(path).is_ok_and(|it| it.st_uid == own && is_socket(&it)));
    paths.sort_unstable();
    Ok(paths)
}

fn own_user() -> u32 {
    rustix::process::geteuid().as_raw()
}

fn is_socket(found: &Stat) -> bool {
    FileType::from_raw_mode(found.st_mode) == FileType::Socket
}

/// So that a directory that is exchanged just now is not bound in. No allocation.
fn address_below(directory: &OwnedFd, name: &str) -> Result<SocketAddrUnix, Errno> {
    let mut path = [0; LONGEST_PATH];
    let number = directory.as_raw_fd();
    let mut rest = path.as_mut_slice();
    write!(rest, "/proc/self/fd/{number}/{name}\0").map_err(|_| Errno::NAMETOOLONG)?;
    let path = CStr::from_bytes_until_nul(&path).map_err(|_| Errno::NAMETOOLONG)?;
    SocketAddrUnix::new(path)
}

pub(super) fn datagram_socket() -> Result<OwnedFd, Errno> {
    socket_with(
        AddressFamily::UNIX,
        SocketType::DGRAM,
        SocketFlags::CLOEXEC | SocketFlags::NONBLOCK,
        None,
    )
}
