//! One interface over every kind of bus.

use std::os::fd::{AsFd, BorrowedFd};

use super::candump::Log;
use super::filter::Filter;
use super::health::{BusHealth, BusState};
use super::local::Participant;
use super::log_report::LogReport;
use super::open_error::OpenError;
use super::playback::Playback;
use super::received::{Drained, Received, StampClock};
use super::room::Shortage;
use super::socket_bus::SocketBus;
use super::socketcan::Interface;
use super::spec::BusSpec;

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

    /// Has the kernel keep so many frames while nobody takes them, also after the bus was lost and found again. What cannot
    /// be had is returned. A log keeps its frames by itself.
    pub fn keep(&mut self, frames: usize) -> Option<Shortage> {
        match &mut self.source {
            Source::Interface(bus) => bus.keep(frames),
            Source::Local(bus) => bus.keep(frames),
            Source::Log(_) => None,
        }
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

    /// Looks after the bus: call it once a tick with the time of a clock that nobody sets \[ns\].
    pub fn supervise(&mut self, now_ns: i64) {
        match &mut self.source {
            Source::Interface(bus) => bus.supervise(now_ns, &mut self.health),
            Source::Local(bus) => bus.supervise(now_ns, &mut self.health),
            Source::Log(_) => {}
        }
    }

    /// The clock of its stamps.
    #[must_use]
    pub fn stamp_clock(&self) -> StampClock {
        match &self.source {
            Source::Interface(_) | Source::Local(_) => StampClock::Realtime,
            Source::Log(_) => StampClock::Boottime,
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
