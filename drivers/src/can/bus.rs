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

    /// Logs of one time are played as they were recorded: what begins later begins later. Call it before any of the buses is
    /// received from.
    pub fn play_together(buses: &mut [Self]) {
        let logs = buses.iter_mut().filter_map(|bus| match &mut bus.source {
            Source::Log(log) => Some(log),
            Source::Interface(_) | Source::Local(_) => None,
        });
        let mut logs: Vec<_> = logs.collect();
        let spans = || logs.iter().map(|log| log.span_ns());
        let latest_first = spans().map(|[first, _]| first).max();
        let earliest_last = spans().map(|[_, last]| last).min();
        if latest_first <= earliest_last {
            Playback::join(&mut logs);
        }
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
    #[inline]
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

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn log(lines: &str, number: u8) -> Bus {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(lines.as_bytes()).unwrap();
        let spec = BusSpec::Candump {
            path: file.path().to_owned(),
            interface: None,
        };
        Bus::open(&spec, number, Filter::All).unwrap()
    }

    /// Of each bus the first stamp, as it is played.
    fn first_stamps(mut buses: [Bus; 2]) -> [i64; 2] {
        Bus::play_together(&mut buses);
        let mut first = [None; 2];
        while first.contains(&None) {
            for bus in &mut buses {
                bus.receive(&mut |received| {
                    first[usize::from(received.bus)].get_or_insert(received.stamp_ns);
                });
            }
        }
        first.map(Option::unwrap)
    }

    #[test]
    fn logs_of_one_time_keep_their_distance() {
        let left = log("(1.000000) can0 001#\n(1.500000) can0 001#\n", 0);
        let right = log("(1.070000) can1 002#\n(1.200000) can1 002#\n", 1);
        let [left_ns, right_ns] = first_stamps([left, right]);
        assert_eq!(right_ns - left_ns, 70_000_000);
    }

    /// Nobody waits a year for one that was recorded then.
    #[test]
    fn logs_of_different_times_begin_at_once() {
        let one = log("(1.000000) can0 001#\n(1.500000) can0 001#\n", 0);
        let other = log(
            "(31536000.000000) can1 002#\n(31536000.100000) can1 002#\n",
            1,
        );
        let [one_ns, other_ns] = first_stamps([one, other]);
        assert!((other_ns - one_ns).abs() < 60_000_000_000);
    }
}
