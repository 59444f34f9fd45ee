//! Sending frames: what simulators and tests do; the daemon only listens, unless CANopen drives are to be started.

use std::io::ErrorKind;
use std::os::fd::OwnedFd;

use rustix::io::Errno;
use rustix::net::{SendFlags, send};

use super::frame::Frame;
use super::local::listeners;
use super::open_error::OpenError;
use super::peers::Peers;
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
    /// None while it is not there.
    Interface(Option<OwnedFd>),
    Local(Peers),
}

impl Sender {
    /// Opens `spec` for sending.
    ///
    /// # Errors
    /// [`OpenError`]; here also an interface that is not there, and [`OpenError::ReadOnly`] for a log.
    pub fn open(spec: &BusSpec) -> Result<Self, OpenError> {
        let target = match spec {
            BusSpec::SocketCan { interface } => Target::Interface(Some(
                sending_socket(interface).map_err(|error| OpenError::interface(spec, error))?,
            )),
            BusSpec::Local { directory } => {
                match listeners(directory) {
                    Err(refusal) if refusal.kind() != ErrorKind::NotFound => {
                        return Err(OpenError::system(spec, refusal));
                    }
                    _ => {}
                }
                Target::Local(
                    Peers::new(directory).map_err(|error| OpenError::system(spec, error))?,
                )
            }
            BusSpec::Candump { .. } => return Err(OpenError::ReadOnly(spec.clone())),
        };
        Ok(Self {
            target,
            counters: SendCounters::default(),
        })
    }

    /// The same, but that an interface need not be there yet: [`Self::reopen`] finds it.
    ///
    /// # Errors
    /// [`OpenError`], where waiting would not help.
    pub fn awaiting(spec: &BusSpec) -> Result<Self, OpenError> {
        let BusSpec::SocketCan { interface } = spec else {
            return Self::open(spec);
        };
        let socket = match sending_socket(interface) {
            Ok(socket) => Some(socket),
            Err(Errno::NODEV | Errno::NXIO) => None,
            Err(error) => return Err(OpenError::interface(spec, error)),
        };
        Ok(Self {
            target: Target::Interface(socket),
            counters: SendCounters::default(),
        })
    }

    /// Opens the interface of `spec` again, after an error. What was sent before and not taken is lost. Does not allocate.
    ///
    /// # Errors
    /// It is still not there.
    pub fn reopen(&mut self, spec: &BusSpec) -> Result<(), Errno> {
        if let (BusSpec::SocketCan { interface }, Target::Interface(socket)) =
            (spec, &mut self.target)
        {
            *socket = Some(sending_socket(interface)?);
        }
        Ok(())
    }

    /// Sends `frame` to everybody on the bus; never blocks. A full queue loses the frame and is counted.
    ///
    /// # Errors
    /// What the interface says: `NETDOWN` if it is down, `NXIO` or `NODEV` if it is gone.
    pub fn send(&mut self, frame: &Frame) -> Result<(), Errno> {
        let raw = frame.to_raw();
        let bytes = raw.get(..frame.raw_size()).unwrap_or(&raw);
        match &mut self.target {
            Target::Interface(socket) => {
                let socket = socket.as_ref().ok_or(Errno::NODEV)?;
                match send(socket, bytes, SendFlags::DONTWAIT) {
                    Ok(_) => {}
                    Err(Errno::NOBUFS | Errno::AGAIN) => self.counters.full += 1,
                    Err(error) => return Err(error),
                }
            }
            Target::Local(peers) => {
                let sent = peers.send(bytes);
                self.counters.full += sent.full;
                self.counters.buried += sent.buried;
            }
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
