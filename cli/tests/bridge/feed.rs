//! A run's sensors, as daemons hear them: encoder frames on each robot's bus, sightings and fixes through shared memory.

use std::collections::BTreeMap;

use coloc_drivers::can::Sender;
use coloc_drivers::encoder::WheelFrames;
use coloc_estimator::Pose;
use coloc_shm_types::{
    AssistCounters, Estimate, Header, Input, Position, Publisher, RelativePose, Sighting, Status,
};
use coloc_sim::StepInputs;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

use crate::team::{Listener, METRES_PER_TICK, ROBOTS, TRACK_M, Team, robot_name};

pub(crate) const STEP_NS: i64 = 20_000_000;

pub(crate) struct Feed {
    robots: Vec<Robot>,
    start_ns: i64,
}

struct Robot {
    bus: Sender,
    wheels: WheelFrames,
    ways_m: [f64; 2],
    sightings: Publisher<RelativePose>,
    /// Of robots that see one another in part.
    parts: Option<Publisher<Sighting>>,
    fixes: Publisher<Position>,
    sent: u64,
}

/// What a daemon published during a drive.
#[derive(Clone, Debug, Default)]
pub(crate) struct Heard {
    /// By tick.
    pub(crate) estimates: BTreeMap<u64, Estimate>,
    /// Of each status those that stand against the belief.
    pub(crate) against: Vec<Vec<(Input, u16)>>,
    /// Of the last status.
    pub(crate) assist: AssistCounters,
}

impl Heard {
    fn listen(&mut self, listener: &Listener) {
        while let Some(estimate) = listener.estimates.receive().unwrap() {
            self.estimates.insert(estimate.tick, estimate);
        }
        while let Some(status) = listener.statuses.receive().unwrap() {
            self.against.push(against(&status));
            self.assist = status.assist;
        }
    }
}

fn against(status: &Status) -> Vec<(Input, u16)> {
    let rows = status.sources().filter(|(_, row)| row.is_against());
    rows.map(|(input, row)| (input, row.source)).collect()
}

impl Feed {
    /// Opens the robots' buses and ports; the daemons are there already.
    pub(crate) fn open(team: &Team) -> Self {
        let space = team.space("feed");
        let robot = |robot| Robot {
            bus: Sender::open(&team.bus(robot)).unwrap(),
            wheels: WheelFrames::new(METRES_PER_TICK),
            ways_m: [0.0; 2],
            sightings: space.publisher(&robot_name(robot)).unwrap(),
            parts: team
                .sees_in_part()
                .then(|| space.publisher(&robot_name(robot)).unwrap()),
            fixes: space.publisher(&robot_name(robot)).unwrap(),
            sent: 0,
        };
        Self {
            robots: (0..ROBOTS).map(robot).collect(),
            start_ns: now_ns(),
        }
    }

    /// When the drive begins \[ns of the inner clock\].
    pub(crate) fn start_ns(&self) -> i64 {
        self.start_ns
    }

    /// Drives through the run in real time; what the daemons published meanwhile.
    pub(crate) fn drive(
        mut self,
        sensors: impl Fn(usize) -> StepInputs,
        steps: usize,
        listeners: &[Listener],
    ) -> Vec<Heard> {
        let mut heard = vec![Heard::default(); ROBOTS];
        let mut deadline_ns = self.start_ns;
        for step in 1..steps {
            deadline_ns += STEP_NS;
            sleep_until(deadline_ns);
            self.send(&sensors(step), deadline_ns);
            for (heard, listener) in heard.iter_mut().zip(listeners) {
                heard.listen(listener);
            }
        }
        heard
    }

    fn send(&mut self, inputs: &StepInputs, stamp_ns: i64) {
        for (robot, odometry) in self.robots.iter_mut().zip(&inputs.odometry) {
            robot.roll(odometry.unwrap_or_default());
        }
        let boot = coloc_shm_types::boot();
        let header = |robot: &mut Robot| {
            robot.sent += 1;
            Header {
                stamp_ns,
                sequence: robot.sent,
                boot,
                ..Header::default()
            }
        };
        for seen in &inputs.sightings {
            let robot = &mut self.robots[seen.observer];
            if robot.parts.is_some() {
                let header = header(robot);
                robot.see_in_part(header, seen.observed, &seen.relative);
                continue;
            }
            let [x, y, phi] = coloc_sim::Scenario::paper().sightings.sigma.map(|s| s * s);
            let message = RelativePose {
                header: header(robot),
                observed: u16::try_from(seen.observed + 1).unwrap(),
                pose: seen.relative.to_vector().into(),
                covariance: [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, phi],
                ..RelativePose::default()
            };
            robot.sightings.send(message).unwrap();
        }
        for fix in &inputs.fixes {
            let robot = &mut self.robots[fix.robot];
            let message = Position {
                header: header(robot),
                quality: 4,
                position: fix.position,
                covariance: [0.01, 0.0, 0.0, 0.01],
                ..Position::default()
            };
            robot.fixes.send(message).unwrap();
        }
    }
}

impl Robot {
    /// What a camera without a slow error says of it.
    fn see_in_part(&self, header: Header, observed: usize, relative: &Pose) {
        let (range, [sigma, ..]) = (
            relative.x.hypot(relative.y),
            coloc_sim::Scenario::paper().sightings.sigma,
        );
        let message = Sighting {
            header,
            observed: u16::try_from(observed + 1).unwrap(),
            has: Sighting::RANGE | Sighting::BEARING,
            who: Sighting::ROBOT,
            range,
            bearing: relative.y.atan2(relative.x),
            white: [sigma * sigma, sigma * sigma / (range * range)],
            slow: [0.01, 6.0, 0.005, 10.0],
            ..Sighting::default()
        };
        self.parts
            .iter()
            .for_each(|port| port.send(message).unwrap());
    }

    #[allow(clippy::cast_precision_loss)] // 20 ms.
    fn roll(&mut self, [v, omega]: [f64; 2]) {
        let (step_s, turn) = (STEP_NS as f64 / 1e9, omega * TRACK_M / 2.0);
        self.ways_m[0] += (v - turn) * step_s;
        self.ways_m[1] += (v + turn) * step_s;
        let [left, right] = self.ways_m;
        for frame in self.wheels.encode(left, right) {
            self.bus.send(&frame).unwrap();
        }
    }
}

fn now_ns() -> i64 {
    let now = clock_gettime(ClockId::Boottime);
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}

fn sleep_until(deadline_ns: i64) {
    let deadline = Timespec {
        tv_sec: deadline_ns / 1_000_000_000,
        tv_nsec: deadline_ns % 1_000_000_000,
    };
    while clock_nanosleep_absolute(ClockId::Boottime, &deadline) == Err(rustix::io::Errno::INTR) {}
}
