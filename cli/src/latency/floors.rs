//! What the machine can do at all, on the same processors, at the same rate, waiting in the same way.

use std::mem::MaybeUninit;
use std::path::Path;
use std::time::Instant;

use coloc_drivers::can::{Bus, BusSpec, Filter};
use coloc_drivers::encoder::RIGHT_ID;
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
    /// From a frame in the kernel to its being read, with nothing behind it.
    pub(crate) frame: Durations,
    /// From one process to another, with nothing before and after it.
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
        bus: &BusSpec,
        root: &Path,
        mode: WaitArg,
        reader: WaitArg,
        placement: &Placement,
        schedule: impl Fn() -> Schedule,
    ) -> Result<Self, LatencyError> {
        Ok(Self {
            sent: u64::try_from(schedule().count).unwrap_or(0),
            frame: frame(bus, mode, placement, schedule())?,
            transport: transport(root, [mode, reader], placement, schedule())?,
            clock: clock(),
        })
    }
}

/// On a thread of its own, as waiting in the daemon's way changes the thread.
fn frame(
    bus: &BusSpec,
    mode: WaitArg,
    placement: &Placement,
    schedule: Schedule,
) -> Result<Durations, LatencyError> {
    let cpus = placement.daemon.clone();
    let spec = bus.clone();
    let bus = Bus::open(&spec, 0, Filter::ids([RIGHT_ID.into()])).map_err(LatencyError::bus)?;
    let reader = on_thread("reader", move || {
        settle(&cpus, mode == WaitArg::Sleep);
        read_frames(bus, mode, schedule.end_ns())
    })?;
    let sender = Sender::of_frames(&spec, schedule, placement)?;
    sender.finish()?;
    let durations = reader
        .join()
        .map_err(|_| LatencyError::Thread("reader"))??;
    Ok(Durations::of(durations))
}

fn read_frames(mut bus: Bus, mode: WaitArg, end_ns: i64) -> Result<Vec<i64>, LatencyError> {
    let epoll = epoll::create(epoll::CreateFlags::CLOEXEC).map_err(LatencyError::bus)?;
    let data = epoll::EventData::new_u64(0);
    epoll::add(&epoll, &bus, data, epoll::EventFlags::IN).map_err(LatencyError::bus)?;
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
        bus.receive(&mut |received| stamps.push(received.stamp_ns));
        let now = clock_gettime(ClockId::Realtime);
        let now = now.tv_sec * 1_000_000_000 + now.tv_nsec;
        durations.extend(stamps.iter().map(|stamp| now - stamp));
    }
    Ok(durations)
}

fn transport(
    root: &Path,
    [mode, reader]: [WaitArg; 2],
    placement: &Placement,
    schedule: Schedule,
) -> Result<Durations, LatencyError> {
    const NAME: &str = "floor";
    let expect = usize::try_from(schedule.count).unwrap_or(0);
    let until_ns = schedule.end_ns();
    let reader = Reader::start(root, NAME, until_ns, expect, reader, placement)?;
    let (root, cpus) = (root.to_owned(), placement.daemon.clone());
    let writer = on_thread("writer", move || -> Result<(), LatencyError> {
        let space = Space::open(&root, PREFIX, "coloc-latency-floor").map_err(LatencyError::shm)?;
        let robot = RobotName::new(NAME).map_err(LatencyError::shm)?;
        let estimates = space
            .publisher::<Estimate>(&robot)
            .map_err(LatencyError::shm)?;
        estimates.refresh().map_err(LatencyError::shm)?;
        settle(&cpus, mode == WaitArg::Sleep);
        for due_ns in schedule.deadlines() {
            wait_until(due_ns, mode);
            interrupted::check()?;
            let header = Header {
                stamp_ns: now_ns(),
                ..Header::default()
            };
            let message = Estimate {
                header,
                ..Estimate::default()
            };
            estimates.send(message).map_err(LatencyError::shm)?;
        }
        // Whoever leaves takes what was not received yet along.
        sleep_until(schedule.end_ns());
        Ok(())
    })?;
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
