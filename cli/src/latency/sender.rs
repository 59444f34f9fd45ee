//! The sensors and the neighbours: open loop, on absolute deadlines, on a thread of its own.

use std::path::Path;
use std::thread::JoinHandle;

use coloc_drivers::can::{BusSpec, Sender as Bus};
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{
    self as shm, Clock, Header, Neighbour, Position, Publisher, RelativePose, RobotName, Space,
};

use super::error::{LatencyError, on_thread};
use super::interrupted;
use super::matching::Sent;
use super::place::PREFIX;
use super::placement::{Placement, settle};
use super::robot_file::{METRES_PER_TICK, ROBOT, pose, sight_of_the_origin, ways_m};
use crate::demo::clock::{now_ns, sleep_until};

/// Deadlines at a fixed rate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Schedule {
    pub(crate) start_ns: i64,
    pub(crate) period_ns: i64,
    pub(crate) count: i64,
    /// From a wheel's frame to the other's.
    pub(crate) gap_ns: i64,
}

impl Schedule {
    pub(crate) fn due_ns(&self, k: i64) -> i64 {
        self.start_ns + k * self.period_ns
    }

    pub(crate) fn end_ns(&self) -> i64 {
        self.due_ns(self.count)
    }

    pub(crate) fn deadlines(self) -> impl Iterator<Item = i64> {
        (0..self.count).map(move |k| self.due_ns(k))
    }

    #[allow(clippy::cast_precision_loss)] // Runs last far less than 2^53 ns.
    fn time_s(&self, at_ns: i64) -> f64 {
        (at_ns - self.start_ns) as f64 / 1e9
    }
}

/// Everything but the wheels speaks this often \[ns\]: 10 Hz.
const OTHERS_NS: i64 = 100_000_000;

/// Runs until the schedule's end.
pub(crate) struct Sender(JoinHandle<Result<Vec<Sent>, LatencyError>>);

impl Sender {
    /// Encoder frames alone, for a floor.
    pub(crate) fn of_frames(
        buses: &[BusSpec],
        schedule: Schedule,
        placement: &Placement,
    ) -> Result<Self, LatencyError> {
        let (buses, cpus) = (buses.to_vec(), placement.others.clone());
        let run = move || {
            settle(&cpus, true);
            Wheels::open(&buses)?.run(schedule, |_| ())
        };
        on_thread("sender", run).map(Self)
    }

    /// Encoder frames, fixes, sightings and what `neighbours` say.
    pub(crate) fn of_everything(
        buses: &[BusSpec],
        root: &Path,
        neighbours: u16,
        schedule: Schedule,
        placement: &Placement,
    ) -> Result<Self, LatencyError> {
        let (buses, root, cpus) = (buses.to_vec(), root.to_owned(), placement.others.clone());
        let run = move || {
            let mut wheels = Wheels::open(&buses)?;
            let mut others = Others::open(&root, neighbours)?;
            settle(&cpus, true);
            wheels.run(schedule, |due_ns| others.speak(&schedule, due_ns))
        };
        on_thread("sender", run).map(Self)
    }

    /// What was sent when.
    pub(crate) fn finish(self) -> Result<Vec<Sent>, LatencyError> {
        self.0.join().unwrap_or(Err(LatencyError::Thread("sender")))
    }
}

struct Wheels {
    left: Bus,
    /// On a bus of its own, if there are two.
    right: Option<Bus>,
    frames: WheelFrames,
}

impl Wheels {
    fn open(buses: &[BusSpec]) -> Result<Self, LatencyError> {
        let mut opened = buses
            .iter()
            .map(|bus| Bus::open(bus).map_err(LatencyError::bus));
        Ok(Self {
            left: opened.next().ok_or(LatencyError::Thread("bus"))??,
            right: opened.next().transpose()?,
            frames: WheelFrames::new(METRES_PER_TICK),
        })
    }

    /// Sends at each deadline, `before` first. Who wakes late still sends all that is due: the schedule does not wait.
    fn run(
        &mut self,
        schedule: Schedule,
        mut before: impl FnMut(i64),
    ) -> Result<Vec<Sent>, LatencyError> {
        let mut sent = Vec::new();
        for due_ns in schedule.deadlines() {
            sleep_until(due_ns);
            interrupted::check()?;
            before(due_ns);
            let [left_m, right_m] = ways_m(schedule.time_s(due_ns));
            let [left, right] = self.frames.encode(left_m, right_m);
            self.left.send(&left).map_err(LatencyError::bus)?;
            let due_ns = due_ns + schedule.gap_ns;
            if schedule.gap_ns > 0 {
                sleep_until(due_ns);
            }
            let sent_ns = now_ns();
            let bus = self.right.as_mut().unwrap_or(&mut self.left);
            bus.send(&right).map_err(LatencyError::bus)?;
            sent.push(Sent { due_ns, sent_ns });
        }
        Ok(sent)
    }
}

struct Others {
    fixes: Publisher<Position>,
    sightings: Publisher<RelativePose>,
    neighbours: Publisher<Neighbour>,
    receiver: shm::Sender,
    sights: shm::Sender,
    team: Vec<shm::Sender>,
    next_ns: i64,
}

impl Others {
    fn open(root: &Path, team: u16) -> Result<Self, LatencyError> {
        let space = Space::open(root, PREFIX, "coloc-latency-sender").map_err(LatencyError::shm)?;
        let robot = RobotName::new(ROBOT).map_err(LatencyError::shm)?;
        let start = |source| shm::Sender::start(source, Clock::Boottime).map_err(LatencyError::shm);
        Ok(Self {
            fixes: space.publisher(&robot).map_err(LatencyError::shm)?,
            sightings: space.publisher(&robot).map_err(LatencyError::shm)?,
            neighbours: space.publisher(&robot).map_err(LatencyError::shm)?,
            receiver: start(0)?,
            sights: start(0)?,
            team: (2..team + 2).map(start).collect::<Result<_, _>>()?,
            next_ns: 0,
        })
    }

    /// What is measured now, of the truth: a message that did not arrive shows in nothing but its own absence.
    fn speak(&mut self, schedule: &Schedule, due_ns: i64) {
        if due_ns < self.next_ns {
            return;
        }
        self.next_ns = due_ns + OTHERS_NS;
        let time_s = schedule.time_s(due_ns);
        let _ = self.fixes.send(fix(self.receiver.header(due_ns), time_s));
        let _ = self
            .sightings
            .send(sighting(self.sights.header(due_ns), time_s));
        for neighbour in &mut self.team {
            let _ = self.neighbours.send(word(neighbour.header(due_ns), time_s));
        }
    }
}

fn fix(header: Header, time_s: f64) -> Position {
    let [x, y, _] = pose(time_s);
    Position {
        header,
        quality: 2,
        position: [x, y],
        covariance: [0.01, 0.0, 0.0, 0.01],
        ..Position::default()
    }
}

fn sighting(header: Header, time_s: f64) -> RelativePose {
    RelativePose {
        header,
        observed: 2,
        pose: sight_of_the_origin(time_s),
        covariance: diagonal([0.01, 0.01, 3e-4]),
        ..RelativePose::default()
    }
}

fn word(header: Header, time_s: f64) -> Neighbour {
    Neighbour {
        header,
        pose: pose(time_s),
        independent: diagonal([0.01, 0.01, 3e-4]),
        dependent: diagonal([0.01, 0.01, 1.7e-3]),
    }
}

fn diagonal([a, b, c]: [f64; 3]) -> [f64; 9] {
    [a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c]
}
