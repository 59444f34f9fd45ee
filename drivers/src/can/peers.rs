//! Everybody who listens on a local bus, for who sends there.

use std::io;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::io::Errno;
use rustix::net::{SendFlags, SocketAddrUnix, connect, sendto, sockopt};

use super::local::{Directory, datagram_socket, listeners};

/// So many listeners one bus has at most: their places are reserved.
const MOST: usize = 64;

/// The listeners of a directory, found again and again. Nothing allocates after the start.
#[derive(Debug)]
pub(super) struct Peers {
    directory: Directory,
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
    address: SocketAddrUnix,
    socket: OwnedFd,
    /// Found by the scan that is going on.
    is_there: bool,
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
    pub(super) fn new(directory: &Path) -> io::Result<Self> {
        Ok(Self {
            directory: Directory::new(directory)?,
            known: Vec::with_capacity(MOST),
            scanned: None,
        })
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
        let Self {
            directory, known, ..
        } = self;
        for peer in known.iter_mut() {
            peer.is_there = false;
        }
        // A bus that is not there yet is waited for.
        let _ = directory.each_listener(&mut |address| {
            if let Some(peer) = known.iter_mut().find(|peer| peer.address == address) {
                peer.is_there = true;
                return;
            }
            // Where there is no descriptor left the next scan tries again.
            let new = || Peer::new(address).ok();
            known.extend((known.len() < MOST).then(new).flatten());
        });
        known.retain(|peer| peer.is_there);
        known.sort_unstable_by(|a, b| a.address.cmp(&b.address));
    }
}

impl Peer {
    fn new(address: SocketAddrUnix) -> Result<Self, Errno> {
        let socket = datagram_socket()?;
        if sockopt::set_socket_send_buffer_size_force(&socket, SEND_BUFFER).is_err() {
            // As much as everybody may have.
            let _ = sockopt::set_socket_send_buffer_size(&socket, SEND_BUFFER);
        }
        Ok(Self {
            address,
            socket,
            is_there: true,
        })
    }

    /// Whether it is still there.
    fn send(&self, bytes: &[u8], sent: &mut Sent) -> bool {
        match sendto(&self.socket, bytes, SendFlags::DONTWAIT, &self.address) {
            Err(Errno::CONNREFUSED) => {
                // Its process died. Somebody else may have buried it in the meantime.
                let path = self.address.path();
                sent.buried += u64::from(path.is_some_and(|it| rustix::fs::unlink(&*it).is_ok()));
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
