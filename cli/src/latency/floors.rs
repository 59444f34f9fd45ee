//! What the machine can do at all, on the same processors, at the same rate, waiting in the same way.

use std::mem::MaybeUninit;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::thread::JoinHandle;
use std::time::Instant;

use coloc_drivers::can::{Bus, BusSpec, Filter, Id};
use coloc_drivers::encoder::{LEFT_ID, RIGHT_ID};
use coloc_shm_types::{Estimate, Header, RobotName, Space};
use rustix::event::{Timespec, epoll};
use rustix::time::{ClockId, clock_gettime};

use super::args::WaitArg;
use super::error::{LatencyError, on_thread};
use super::interrupted;
use super::percentiles::Durations;
use super::place::PREFIX;
use super::placement::{Placement, settle};
use super::reader::Reader;
use super::sender::{Schedule, Sender};
use crate::demo::clock::{now_ns, sleep_until};

/// Durations below which nothing can fall \[ns\].
pub(crate) struct Floors {
    /// From the second wheel's frame in the kernel to its being read, with nothing behind it.
    pub(crate) frame: Durations,
    /// As many bytes as an estimate from one process to another, with nothing before and after it: a Unix datagram where the reader
    /// sleeps, shared memory where it polls.
    pub(crate) transport: Durations,
    /// Reading a clock.
    pub(crate) clock: Durations,
    /// So many frames and messages were sent for the first two, each.
    pub(crate) sent: u64,
}

impl Floors {
    /// Counts those of `more` as well.
    pub(crate) fn add(&mut self, more: &Self) {
        self.frame.add(&more.frame);
        self.transport.add(&more.transport);
        self.clock.add(&more.clock);
        self.sent += more.sent;
    }

    /// Measures all three; each takes as long as the schedule.
    pub(crate) fn measure(
        buses: &[BusSpec],
        [directory, root]: [&Path; 2],
        [mode, reader]: [WaitArg; 2],
        placement: &Placement,
        schedule: impl Fn() -> Schedule,
    ) -> Result<Self, LatencyError> {
        let transport = match reader {
            WaitArg::Sleep => datagrams(directory, mode, placement, schedule())?,
            WaitArg::Poll => shared_memory(root, mode, placement, schedule())?,
        };
        Ok(Self {
            sent: u64::try_from(schedule().count).unwrap_or(0),
            frame: frame(buses, mode, placement, schedule())?,
            transport,
            clock: clock(),
        })
    }
}

/// On a thread of its own, as waiting in the daemon's way changes the thread.
fn frame(
    buses: &[BusSpec],
    mode: WaitArg,
    placement: &Placement,
    schedule: Schedule,
) -> Result<Durations, LatencyError> {
    let cpus = placement.daemon.clone();
    let wheels = || Filter::ids([LEFT_ID.into(), RIGHT_ID.into()]);
    let opened = (0..)
        .zip(buses)
        .map(|(number, bus)| Bus::open(bus, number, wheels()).map_err(LatencyError::bus));
    let opened = opened.collect::<Result<Vec<_>, _>>()?;
    let reader = on_thread("reader", move || {
        settle(&cpus, mode == WaitArg::Sleep);
        read_frames(opened, mode, schedule.end_ns())
    })?;
    let sender = Sender::of_frames(buses, schedule, placement)?;
    sender.finish()?;
    let durations = reader
        .join()
        .map_err(|_| LatencyError::Thread("reader"))??;
    Ok(Durations::of(durations))
}

/// Of the frames of the right wheel, which are what is waited for.
fn read_frames(mut buses: Vec<Bus>, mode: WaitArg, end_ns: i64) -> Result<Vec<i64>, LatencyError> {
    let epoll = epoll::create(epoll::CreateFlags::CLOEXEC).map_err(LatencyError::bus)?;
    let data = epoll::EventData::new_u64(0);
    for bus in &buses {
        epoll::add(&epoll, bus, data, epoll::EventFlags::IN).map_err(LatencyError::bus)?;
    }
    let right = Some(Id::from(RIGHT_ID));
    let timeout = match mode {
        WaitArg::Poll => 0,
        WaitArg::Sleep => 100_000_000, // To see the end.
    };
    let timeout = Timespec {
        tv_sec: 0,
        tv_nsec: timeout,
    };
    let (mut durations, mut stamps) = (Vec::new(), Vec::with_capacity(64));
    while now_ns() < end_ns && interrupted::signal().is_none() {
        let mut storage = [MaybeUninit::<epoll::Event>::uninit(); 8];
        // Interrupted or not: what is there is read.
        let _ = epoll::wait(&epoll, &mut storage, Some(&timeout));
        stamps.clear();
        for bus in &mut buses {
            bus.receive(&mut |received| {
                if received.frame.id() == right {
                    stamps.push(received.stamp_ns);
                }
            });
        }
        let now = clock_gettime(ClockId::Realtime);
        let now = now.tv_sec * 1_000_000_000 + now.tv_nsec;
        durations.extend(stamps.iter().map(|stamp| now - stamp));
    }
    Ok(durations)
}

/// Who reads datagrams or estimates of it.
const NAME: &str = "floor";

fn datagrams(
    directory: &Path,
    mode: WaitArg,
    placement: &Placement,
    schedule: Schedule,
) -> Result<Durations, LatencyError> {
    let reader = Reader::of_datagrams(directory, NAME, schedule.end_ns(), placement)?;
    let (path, cpus) = (directory.join(NAME), placement.daemon.clone());
    let writer = on_thread("writer", move || -> Result<(), LatencyError> {
        let socket = UnixDatagram::unbound().map_err(LatencyError::bus)?;
        socket.connect(path).map_err(LatencyError::bus)?;
        settle(&cpus, mode == WaitArg::Sleep);
        let mut bytes = [0; size_of::<Estimate>()];
        at_deadlines(schedule, mode, || {
            if let Some(stamp) = bytes.first_chunk_mut() {
                *stamp = now_ns().to_ne_bytes();
            }
            socket.send(&bytes).map(drop).map_err(LatencyError::bus)
        })
    })?;
    finish(writer, reader)
}

fn shared_memory(
    root: &Path,
    mode: WaitArg,
    placement: &Placement,
    schedule: Schedule,
) -> Result<Durations, LatencyError> {
    let expect = usize::try_from(schedule.count).unwrap_or(0);
    let until_ns = schedule.end_ns();
    let reader = Reader::start(root, NAME, until_ns, expect, WaitArg::Poll, placement)?;
    let (root, cpus) = (root.to_owned(), placement.daemon.clone());
    let writer = on_thread("writer", move || -> Result<(), LatencyError> {
        let space = Space::open(&root, PREFIX, "coloc-latency-floor").map_err(LatencyError::shm)?;
        let robot = RobotName::new(NAME).map_err(LatencyError::shm)?;
        let estimates = space
            .publisher::<Estimate>(&robot)
            .map_err(LatencyError::shm)?;
        estimates.refresh().map_err(LatencyError::shm)?;
        settle(&cpus, mode == WaitArg::Sleep);
        at_deadlines(schedule, mode, || {
            let header = Header {
                stamp_ns: now_ns(),
                ..Header::default()
            };
            let message = Estimate {
                header,
                ..Estimate::default()
            };
            estimates.send(message).map_err(LatencyError::shm)
        })?;
        // Whoever leaves takes what was not received yet along.
        sleep_until(schedule.end_ns());
        Ok(())
    })?;
    finish(writer, reader)
}

fn at_deadlines(
    schedule: Schedule,
    mode: WaitArg,
    mut send: impl FnMut() -> Result<(), LatencyError>,
) -> Result<(), LatencyError> {
    for due_ns in schedule.deadlines() {
        wait_until(due_ns, mode);
        interrupted::check()?;
        send()?;
    }
    Ok(())
}

fn finish(
    writer: JoinHandle<Result<(), LatencyError>>,
    reader: Reader,
) -> Result<Durations, LatencyError> {
    writer
        .join()
        .map_err(|_| LatencyError::Thread("writer"))??;
    let seen = reader.finish()?;
    Ok(Durations::of(
        seen.iter().map(|seen| seen.received_ns - seen.stamp_ns),
    ))
}

fn wait_until(due_ns: i64, mode: WaitArg) {
    match mode {
        WaitArg::Sleep => sleep_until(due_ns),
        WaitArg::Poll => while now_ns() < due_ns {},
    }
}

/// In thousands, as one is too short to be timed.
fn clock() -> Durations {
    const READS: u32 = 1000;
    Durations::of((0..1000).map(|_| {
        let begin = Instant::now();
        for _ in 0..READS {
            std::hint::black_box(now_ns());
        }
        i64::try_from((begin.elapsed() / READS).as_nanos()).unwrap_or(i64::MAX)
    }))
}
