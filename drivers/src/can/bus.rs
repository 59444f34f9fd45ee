//! One interface over every kind of bus.

use std::io;
use std::os::fd::{AsFd, BorrowedFd};

use rustix::io::Errno;

use super::candump::{Log, LogError};
use super::filter::Filter;
use super::frame::Frame;
use super::health::{BusHealth, BusState};
use super::local::Participant;
use super::log_report::LogReport;
use super::playback::Playback;
use super::socket_bus::SocketBus;
use super::socketcan::Interface;
use super::spec::BusSpec;

/// A frame, when and from where it came.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Received {
    /// What came.
    pub frame: Frame,
    /// When the kernel received it \[ns of `CLOCK_REALTIME`\].
    pub stamp_ns: i64,
    /// The number that [`Bus::open`] gave to the bus.
    pub bus: u8,
}

/// What one call of [`Bus::receive`] did.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Drained {
    /// Frames handed on.
    pub frames: usize,
    /// The call ended at its limit of [`FRAMES_PER_CALL`]: more may be waiting.
    pub more: bool,
}

/// The most that one call of [`Bus::receive`] takes off a bus: a flooded bus must not hold the tick hostage.
pub const FRAMES_PER_CALL: usize = 256;

/// A bus to receive from: a CAN interface, a recorded log or a local bus. One descriptor to wait on, the same for life.
///
/// After [`Bus::open`] nothing here allocates or blocks, also not when a lost bus is opened again.
#[derive(Debug)]
pub struct Bus {
    number: u8,
    filter: Filter,
    health: BusHealth,
    source: Source,
}

#[derive(Debug)]
enum Source {
    Interface(SocketBus<Interface>),
    Local(SocketBus<Participant>),
    Log(Playback),
}

/// Why a bus can't be opened; trying again will not help.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The kernel was built without CAN, or its modules are not loaded.
    #[error(
        "this kernel offers no CAN sockets: load the modules can and can_raw, or use a local: bus"
    )]
    NoCan,
    /// The interface exists and is something else.
    #[error(
        "{0} names an interface that carries no CAN: 'ip -details link show' tells which ones do"
    )]
    NotCan(BusSpec),
    /// A log is read only.
    #[error("{0} is a recorded log: nothing can be sent there")]
    ReadOnly(BusSpec),
    /// The log can't be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// Anything else that the system refused.
    #[error("can't open {bus}: {error}")]
    System {
        /// The bus.
        bus: BusSpec,
        /// What the system said.
        error: io::Error,
    },
}

impl OpenError {
    pub(super) fn system(bus: &BusSpec, error: impl Into<io::Error>) -> Self {
        Self::System {
            bus: bus.clone(),
            error: error.into(),
        }
    }

    pub(super) fn interface(bus: &BusSpec, error: Errno) -> Self {
        match error {
            Errno::AFNOSUPPORT | Errno::PROTONOSUPPORT => Self::NoCan,
            Errno::OPNOTSUPP => Self::NotCan(bus.clone()),
            error => Self::system(bus, error),
        }
    }
}

impl Bus {
    /// Opens `spec`. What it receives will carry `number`; what `filter` does not want stays in the kernel.
    ///
    /// An interface that is down or not there yet is no error: [`Bus::supervise`] waits for it.
    ///
    /// # Errors
    /// [`OpenError`] where waiting would not help.
    pub fn open(spec: &BusSpec, number: u8, filter: Filter) -> Result<Self, OpenError> {
        let mut health = BusHealth::new(BusState::Up);
        let source = match spec {
            BusSpec::SocketCan { interface } => {
                let endpoint = Interface::new(interface, &filter);
                let bus = SocketBus::new(endpoint, &mut health)
                    .map_err(|error| OpenError::interface(spec, error))?;
                Source::Interface(bus)
            }
            BusSpec::Local { directory } => {
                let endpoint = Participant::new(directory, &filter)
                    .map_err(|error| OpenError::system(spec, error))?;
                let bus = SocketBus::new(endpoint, &mut health)
                    .map_err(|error| OpenError::system(spec, error))?;
                Source::Local(bus)
            }
            BusSpec::Candump { path, interface } => {
                let log = Log::read(path, interface.as_deref(), &filter)?;
                health.counters.malformed = log.report().damaged;
                Source::Log(Playback::new(log).map_err(|error| OpenError::system(spec, error))?)
            }
        };
        Ok(Self {
            number,
            filter,
            health,
            source,
        })
    }

    /// Hands everything that has arrived to `sink`, in the order of arrival, error frames included; never blocks.
    pub fn receive(&mut self, sink: &mut impl FnMut(&Received)) -> Drained {
        let Self {
            number,
            filter,
            health,
            source,
        } = self;
        match source {
            Source::Interface(bus) => bus.receive(*number, filter, health, sink),
            Source::Local(bus) => bus.receive(*number, filter, health, sink),
            Source::Log(log) => log.receive(*number, filter, health, sink),
        }
    }

    /// Looks after the bus: call it once a tick with the time of `CLOCK_MONOTONIC` \[ns\].
    pub fn supervise(&mut self, now_ns: i64) {
        match &mut self.source {
            Source::Interface(bus) => bus.supervise(now_ns, &mut self.health),
            Source::Local(bus) => bus.supervise(now_ns, &mut self.health),
            Source::Log(_) => {}
        }
    }

    /// State and counters.
    #[must_use]
    pub fn health(&self) -> &BusHealth {
        &self.health
    }

    /// What was found in the log beside its frames; `None` for a bus that is none. Complete from the start: say it then.
    #[must_use]
    pub fn log(&self) -> Option<&LogReport> {
        match &self.source {
            Source::Log(log) => Some(log.report()),
            Source::Interface(_) | Source::Local(_) => None,
        }
    }

    /// The number given to [`Bus::open`].
    #[must_use]
    pub fn number(&self) -> u8 {
        self.number
    }
}

impl AsFd for Bus {
    /// Readable when [`Bus::receive`] has something to do; for level-triggered `poll` or `epoll`.
    fn as_fd(&self) -> BorrowedFd<'_> {
        match &self.source {
            Source::Interface(bus) => bus.as_fd(),
            Source::Local(bus) => bus.as_fd(),
            Source::Log(log) => log.as_fd(),
        }
    }
}
