//! Everybody who listens on a local bus, for who sends there.

use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::io::Errno;
use rustix::net::{SendFlags, SocketAddrUnix, connect, sendto, sockopt};

use super::local::{datagram_socket, listeners};

/// The listeners of a directory, found again and again.
#[derive(Debug)]
pub(super) struct Peers {
    directory: PathBuf,
    known: Vec<Peer>,
    scanned: Option<Instant>,
}

/// What became of a frame.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Sent {
    /// Listeners whose queue was full.
    pub(super) full: u64,
    /// Sockets of the dead that were removed.
    pub(super) buried: u64,
}

/// A listener, and a socket for it alone: what waits for one takes the buffer of whoever sent it, and one that does not
/// read must not take it from the others.
#[derive(Debug)]
struct Peer {
    path: PathBuf,
    address: SocketAddrUnix,
    socket: OwnedFd,
}

/// How long a newcomer may go unnoticed.
const SCAN_INTERVAL: Duration = Duration::from_millis(50);

/// What may wait for one listener, if the kernel grants it \[bytes\].
const SEND_BUFFER: usize = 8 << 20;

/// Removes the sockets of those in `directory` who were killed.
pub(super) fn bury_the_dead(directory: &Path) {
    let Ok(socket) = datagram_socket() else {
        return; // Whoever is in need of descriptors says so elsewhere.
    };
    for path in listeners(directory).unwrap_or_default() {
        let called = SocketAddrUnix::new(&path).and_then(|address| connect(&socket, &address));
        if called == Err(Errno::CONNREFUSED) {
            // Somebody else may be doing the same.
            let _ = rustix::fs::unlink(&path);
        }
    }
}

impl Peers {
    pub(super) fn new(directory: &Path) -> Self {
        Self {
            directory: directory.to_owned(),
            known: Vec::new(),
            scanned: None,
        }
    }

    /// To everybody, without waiting for anybody.
    pub(super) fn send(&mut self, bytes: &[u8]) -> Sent {
        let is_due = |scanned: Instant| scanned.elapsed() >= SCAN_INTERVAL;
        if self.scanned.is_none_or(is_due) {
            self.scan();
        }
        let mut sent = Sent::default();
        self.known.retain(|peer| peer.send(bytes, &mut sent));
        sent
    }

    fn scan(&mut self) {
        self.scanned = Some(Instant::now());
        // A bus that is not there yet is waited for.
        let paths = listeners(&self.directory).unwrap_or_default();
        self.known.retain(|peer| paths.contains(&peer.path));
        let is_new = |path: &PathBuf| self.known.iter().all(|peer| peer.path != *path);
        let new: Vec<_> = paths.into_iter().filter(is_new).collect();
        // Where there is no descriptor left the next scan tries again.
        self.known
            .extend(new.into_iter().filter_map(|path| Peer::new(path).ok()));
        self.known.sort_by(|a, b| a.path.cmp(&b.path));
    }
}

impl Peer {
    fn new(path: PathBuf) -> Result<Self, Errno> {
        let (address, socket) = (SocketAddrUnix::new(&path)?, datagram_socket()?);
        if sockopt::set_socket_send_buffer_size_force(&socket, SEND_BUFFER).is_err() {
            // As much as everybody may have.
            let _ = sockopt::set_socket_send_buffer_size(&socket, SEND_BUFFER);
        }
        Ok(Self {
            path,
            address,
            socket,
        })
    }

    /// Whether it is still there.
    fn send(&self, bytes: &[u8], sent: &mut Sent) -> bool {
        match sendto(&self.socket, bytes, SendFlags::DONTWAIT, &self.address) {
            Err(Errno::CONNREFUSED) => {
                // Its process died. Somebody else may have buried it in the meantime.
                sent.buried += u64::from(rustix::fs::unlink(&self.path).is_ok());
                false
            }
            Err(Errno::AGAIN | Errno::NOBUFS) => {
                sent.full += 1;
                true
            }
            Err(_) => false,
            Ok(_) => true,
        }
    }
}
