//! Sending frames: what simulators and tests do; the daemon only listens.

use std::io::ErrorKind;
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use rustix::io::Errno;
use rustix::net::{SendFlags, SocketAddrUnix, send, sendto};

use super::frame::Frame;
use super::local::{datagram_socket, listeners};
use super::open_error::OpenError;
use super::socketcan::sending_socket;
use super::spec::BusSpec;

/// A sender on a CAN interface or a local bus.
#[derive(Debug)]
pub struct Sender {
    target: Target,
    counters: SendCounters,
}

/// What a sender has counted.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct SendCounters {
    /// Frames sent.
    pub sent: u64,
    /// Frames that one receiver of a local bus lost because its queue was full, or that found the interface's full.
    pub full: u64,
    /// Sockets of the dead that were removed from a local bus.
    pub buried: u64,
}

#[derive(Debug)]
enum Target {
    Interface(OwnedFd),
    Local(Peers),
}

impl Sender {
    /// Opens `spec` for sending.
    ///
    /// # Errors
    /// [`OpenError`]; here also an interface that is not there, and [`OpenError::ReadOnly`] for a log.
    pub fn open(spec: &BusSpec) -> Result<Self, OpenError> {
        let target = match spec {
            BusSpec::SocketCan { interface } => Target::Interface(
                sending_socket(interface).map_err(|error| OpenError::interface(spec, error))?,
            ),
            BusSpec::Local { directory } => {
                match listeners(directory) {
                    Err(refusal) if refusal.kind() != ErrorKind::NotFound => {
                        return Err(OpenError::system(spec, refusal));
                    }
                    _ => {}
                }
                let socket = datagram_socket().map_err(|error| OpenError::system(spec, error))?;
                Target::Local(Peers {
                    directory: directory.clone(),
                    socket,
                    known: Vec::new(),
                    scanned: None,
                })
            }
            BusSpec::Candump { .. } => return Err(OpenError::ReadOnly(spec.clone())),
        };
        Ok(Self {
            target,
            counters: SendCounters::default(),
        })
    }

    /// Sends `frame` to everybody on the bus; never blocks. A full queue loses the frame and is counted.
    ///
    /// # Errors
    /// What the interface says: `NETDOWN` if it is down, `NXIO` or `NODEV` if it is gone.
    pub fn send(&mut self, frame: &Frame) -> Result<(), Errno> {
        let raw = frame.to_raw();
        let bytes = raw.get(..frame.raw_size()).unwrap_or(&raw);
        match &mut self.target {
            Target::Interface(socket) => match send(socket, bytes, SendFlags::DONTWAIT) {
                Ok(_) => {}
                Err(Errno::NOBUFS | Errno::AGAIN) => self.counters.full += 1,
                Err(error) => return Err(error),
            },
            Target::Local(peers) => peers.send(bytes, &mut self.counters),
        }
        self.counters.sent += 1;
        Ok(())
    }

    /// What has been counted so far.
    #[must_use]
    pub fn counters(&self) -> SendCounters {
        self.counters
    }
}

/// Everybody who listens on a local bus.
#[derive(Debug)]
struct Peers {
    directory: PathBuf,
    socket: OwnedFd,
    known: Vec<(PathBuf, SocketAddrUnix)>,
    scanned: Option<Instant>,
}

/// How long a newcomer may go unnoticed.
const SCAN_INTERVAL: Duration = Duration::from_millis(50);

impl Peers {
    fn send(&mut self, bytes: &[u8], counters: &mut SendCounters) {
        if self
            .scanned
            .is_none_or(|scanned| scanned.elapsed() >= SCAN_INTERVAL)
        {
            self.scan();
        }
        let socket = &self.socket;
        self.known.retain(|(path, address)| {
            match sendto(socket, bytes, SendFlags::DONTWAIT, address) {
                Err(Errno::CONNREFUSED) => {
                    // Its process died. Somebody else may have buried it in the meantime.
                    counters.buried += u64::from(rustix::fs::unlink(path).is_ok());
                    false
                }
                Err(Errno::AGAIN | Errno::NOBUFS) => {
                    counters.full += 1;
                    true
                }
                Err(_) => false,
                Ok(_) => true,
            }
        });
    }

    fn scan(&mut self) {
        self.scanned = Some(Instant::now());
        // A bus that is not there yet is waited for.
        let paths = listeners(&self.directory).unwrap_or_default();
        self.known = paths
            .into_iter()
            .filter_map(|path| {
                let address = SocketAddrUnix::new(&path).ok()?;
                Some((path, address))
            })
            .collect();
    }
}
