//! Listening in on buses for a moment, to whatever is said there: for the person who wonders why the wanted frames do not come.

use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use super::bus::Bus;
use super::candump::Log;
use super::filter::Filter;
use super::heard::Heard;
use super::open_error::OpenError;
use super::received::Received;
use super::spec::BusSpec;

/// So much of a log is looked at: its beginning says what is in it.
const LOG_FRAMES: usize = 10_000;

/// Listens on all of `buses` at once for `time`, through sockets of its own: whoever drains the buses otherwise notices
/// nothing. A log is read from its beginning, as far as it needs to be known. Blocks and allocates.
#[must_use]
pub fn listen(buses: &[BusSpec], time: Duration) -> Vec<Result<Heard, OpenError>> {
    let mut ears: Vec<_> = buses.iter().map(Ear::open).collect();
    let deadline = Instant::now() + time;
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() || wait(&ears, left).is_err() {
            break;
        }
        ears.iter_mut().flatten().for_each(Ear::take);
    }
    ears.into_iter()
        .map(|ear| ear.map(|ear| ear.heard))
        .collect()
}

/// An end of a bus.
struct Ear {
    bus: Option<Bus>,
    heard: Heard,
}

impl Ear {
    fn open(spec: &BusSpec) -> Result<Self, OpenError> {
        let mut heard = Heard::default();
        let bus = match spec {
            BusSpec::Candump { path, interface } => {
                let log = Log::read_beginning(path, interface.as_deref(), LOG_FRAMES)?;
                log.frames().iter().for_each(|log| heard.note(&log.frame));
                None
            }
            // Who listens in makes no place.
            BusSpec::Local { directory } if !directory.exists() => None,
            _ => Some(Bus::open(spec, 0, Filter::All)?),
        };
        Ok(Self { bus, heard })
    }

    fn take(&mut self) {
        let Self { bus, heard } = self;
        if let Some(bus) = bus {
            bus.receive(&mut |received: &Received| heard.note(&received.frame));
        }
    }
}

/// Until one of them has something to say.
fn wait(ears: &[Result<Ear, OpenError>], left: Duration) -> Result<(), Errno> {
    let buses = ears.iter().flatten().filter_map(|ear| ear.bus.as_ref());
    let mut fds: Vec<_> = buses
        .map(|bus| PollFd::from_borrowed_fd(bus.as_fd(), PollFlags::IN))
        .collect();
    let left = Timespec::try_from(left).map_err(|_| Errno::INVAL)?;
    match poll(&mut fds, Some(&left)) {
        Ok(_) | Err(Errno::INTR) => Ok(()),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Frame, Id, Sender, StandardId};
    use super::*;

    fn frame(id: u16) -> Frame {
        Frame::data_frame(StandardId::new(id).unwrap(), &[]).unwrap()
    }

    fn id(raw: u16) -> Id {
        StandardId::new(raw).unwrap().into()
    }

    #[test]
    fn everything_is_heard_while_somebody_else_filters() {
        let directory = tempfile::tempdir().unwrap();
        let spec = BusSpec::Local {
            directory: directory.path().into(),
        };
        let mut other = Bus::open(&spec, 0, Filter::ids([id(1)])).unwrap();
        let mut sender = Sender::open(&spec).unwrap();
        let listening = {
            let spec = spec.clone();
            std::thread::spawn(move || listen(&[spec], Duration::from_millis(400)))
        };
        while !listening.is_finished() {
            for raw in [1, 2] {
                sender.send(&frame(raw)).unwrap();
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let heard = listening.join().unwrap().pop().unwrap().unwrap();
        assert!(heard.of(id(1)) > 0 && heard.of(id(2)) > 0, "{heard:?}");
        other.receive(&mut |received| assert_eq!(received.frame.id(), Some(id(1))));
        let left = std::fs::read_dir(directory.path()).unwrap().count();
        assert_eq!(left, 1, "who listened in has left");
    }

    #[test]
    fn a_bus_that_is_not_there_is_silent_and_is_not_made() {
        let directory = tempfile::tempdir().unwrap();
        let gone = directory.path().join("gone");
        let spec = BusSpec::Local {
            directory: gone.clone(),
        };
        let heard = listen(&[spec], Duration::from_millis(1));
        assert!(matches!(heard.as_slice(), [Ok(heard)] if *heard == Heard::default()));
        assert!(!gone.exists());
    }

    #[test]
    fn of_a_log_the_beginning_is_heard() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("x.log");
        let line = |n: usize| format!("({n}.000000) can{} {:03X}#\n", n % 2, n % 4);
        std::fs::write(&path, (0..40_000).map(line).collect::<String>()).unwrap();
        let listen = |interface: Option<&str>| {
            let spec = BusSpec::Candump {
                path: path.clone(),
                interface: interface.map(str::to_owned),
            };
            listen(&[spec], Duration::ZERO).pop().unwrap().unwrap()
        };
        let (all, one) = (listen(None), listen(Some("can1")));
        assert_eq!((all.frames, all.of(id(0))), (10_000, 2_500));
        assert_eq!(
            (one.frames, one.of(id(0)), one.of(id(1))),
            (10_000, 0, 5_000)
        );
    }
}
