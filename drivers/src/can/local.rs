//! A bus between processes of one machine, without CAN in the kernel: a directory of Unix datagram sockets.
//!
//! Every participant that listens binds one socket in the directory; a sender sends the raw bytes of a frame
//! (see [`super::Frame`]) to every socket there. The kernel stamps the datagrams on arrival as it stamps CAN frames,
//! and filters them by identifier before they wake anybody (classic BPF, since Unix sockets know no CAN filters).
//!
//! The kernel queues `net.unix.max_dgram_qlen` + 1 datagrams a socket (11 where the limit is the usual 10) and makes
//! the sender lose what comes on top, whatever the buffer sizes say. Because of the filter only wanted frames count:
//! two a tick leave a daemon five ticks of slack. Cumulative encoder counters lose nothing even beyond.

use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, bind, socket_with};

use super::filter::Filter;
use super::health::BusState;
use super::socket_bus::Endpoint;
use super::socketcan::ON;
use super::sys;

/// A participant that listens: its socket's address and filter, prepared once.
#[derive(Debug)]
pub(super) struct Participant {
    path: PathBuf,
    address: SocketAddrUnix,
    program: Option<Vec<libc::sock_filter>>,
}

/// Tells the participants of one process apart.
static PARTICIPANTS: AtomicU32 = AtomicU32::new(0);

impl Participant {
    /// Takes a name of its own in `directory`, which is made if it is not there.
    pub(super) fn new(directory: &Path, filter: &Filter) -> io::Result<Self> {
        std::fs::create_dir_all(directory)?;
        let number = PARTICIPANTS.fetch_add(1, Ordering::Relaxed);
        let path = directory.join(format!("{}-{number}", std::process::id()));
        let address = SocketAddrUnix::new(&path)?;
        Ok(Self {
            path,
            address,
            program: filter.bpf_program(),
        })
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
        // Left behind by a process that had our number, or by our own socket before it was lost.
        let _ = rustix::fs::unlink(&self.path);
        bind(fd, &self.address)?;
        Ok(socket)
    }

    fn state(&self, _: BorrowedFd<'_>) -> BusState {
        if rustix::fs::stat(&self.path).is_ok() {
            BusState::Up
        } else {
            BusState::Gone
        }
    }
}

impl Drop for Participant {
    fn drop(&mut self) {
        // It may be gone already, with the directory; there is nobody left to tell.
        let _ = rustix::fs::unlink(&self.path);
    }
}

pub(super) fn datagram_socket() -> Result<OwnedFd, Errno> {
    socket_with(
        AddressFamily::UNIX,
        SocketType::DGRAM,
        SocketFlags::CLOEXEC | SocketFlags::NONBLOCK,
        None,
    )
}
