//! A robot that drives straight ahead on a real CAN interface, tick by tick, with a clock that the test runs.
//!
//! The daemon's own tick code runs here. As the kernel's stamps are not of the test's clock, the daemon takes a frame to be as
//! old as the tick that reads it: so every tick is exact, however busy the machine is.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use coloc_daemon::clock::{Reading, TimeSource};
use coloc_daemon::config::Config;
use coloc_daemon::event::Link;
use coloc_daemon::tick::Robot;
use coloc_daemon::wait::Wake;
use coloc_drivers::can::{ErrorClass, Frame, Sender};
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{BusState, Estimate, Health, Input, RobotName, Space, Subscriber};
use tempfile::TempDir;

use crate::robot::{METRES_PER_TICK, configuration};
use crate::support::Interface;

/// Frames of the left and the right encoder.
pub(crate) type Pair = [Frame; 2];

const SECOND_NS: i64 = 1_000_000_000;
const PERIOD_NS: i64 = SECOND_NS / 50;
/// Way of a wheel in a tick: 0.5 m/s.
const STEP_M: f64 = 0.01;
/// The encoders' counters pass 2³² in every fault.
const FIRST_COUNT: u32 = u32::MAX - 30_000;

/// `CLOCK_MONOTONIC` and `CLOCK_REALTIME`, as far as the daemon knows.
#[derive(Clone, Default)]
pub(crate) struct TestTime(Arc<[AtomicI64; 2]>);

impl TestTime {
    fn run(&self, nanos: i64) {
        self.0
            .iter()
            .for_each(|clock| _ = clock.fetch_add(nanos, Ordering::Relaxed));
    }

    /// Sets `CLOCK_REALTIME`.
    pub(crate) fn step(&self, nanos: i64) {
        self.0[1].fetch_add(nanos, Ordering::Relaxed);
    }
}

impl TimeSource for TestTime {
    fn read(&self) -> Reading {
        let [monotonic_ns, realtime_ns] =
            [0, 1].map(|clock: usize| self.0[clock].load(Ordering::Relaxed));
        Reading {
            monotonic_ns,
            realtime_ns,
            tai_ns: realtime_ns,
        }
    }
}

/// What a user sees of a robot after a tick.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Seen {
    pub(crate) health: Health,
    pub(crate) bus: BusState,
    /// How far the pose is from where the robot is, which goes as far as its wheels, straight ahead.
    pub(crate) error_m: f64,
}

pub(crate) struct Stage {
    pub(crate) interface: Interface,
    pub(crate) sender: Sender,
    pub(crate) time: TestTime,
    /// Ticks since the fault began, the first is 1.
    pub(crate) tick: u32,
    /// What the encoders had to say in the tick before.
    pub(crate) before: Pair,
    /// What they said when they got stuck.
    pub(crate) stuck: Option<Pair>,
    encoders: WheelFrames,
    way_m: [f64; 2],
    robot: Robot,
    estimates: Subscriber<Estimate>,
    _space: (Space, TempDir),
}

impl Stage {
    pub(crate) fn new(interface: &'static str) -> Self {
        let interface = Interface::new(interface);
        let directory = tempfile::tempdir().unwrap();
        let root = directory.path().join("shm");
        let text = configuration(&interface.spec(), &interface.spec(), "timer", &root);
        let config = Config::parse(&text, Path::new("robot.toml")).unwrap();
        let space = Space::open(&root, "can", "test").unwrap();
        let time = TestTime::default();
        time.run(1_000_000 * SECOND_NS);
        let estimates = space
            .subscriber(&RobotName::new("robot1").unwrap())
            .unwrap();
        let robot = Robot::open(
            &config,
            &space,
            Box::new(time.clone()),
            Arc::new(Link::new()),
        )
        .unwrap();
        let mut encoders = WheelFrames::starting_at(FIRST_COUNT, METRES_PER_TICK);
        let before = encoders.encode(0.0, 0.0);
        let (sender, way_m) = (interface.sender(), [0.0; 2]);
        let _space = (space, directory);
        Self {
            interface,
            sender,
            time,
            tick: 0,
            before,
            stuck: None,
            encoders,
            way_m,
            robot,
            estimates,
            _space,
        }
    }

    /// The next frames of two wheels that turn by so much of a step.
    fn next_pair(&mut self, steps: [f64; 2]) -> Pair {
        self.way_m[0] += steps[0] * STEP_M;
        self.way_m[1] += steps[1] * STEP_M;
        self.encoders.encode(self.way_m[0], self.way_m[1])
    }

    /// One tick of a robot that is well.
    pub(crate) fn drive(&mut self) -> Seen {
        self.tick_with(&mut |stage, pair| stage.send(&pair))
    }

    /// One tick, in which `happen` decides what is on the bus.
    pub(crate) fn tick_with(&mut self, happen: &mut dyn FnMut(&mut Self, Pair)) -> Seen {
        self.tick += 1;
        let pair = self.next_pair([1.0; 2]);
        happen(self, pair);
        self.before = pair;
        self.time.run(PERIOD_NS);
        let deadline_ns = self.time.monotonic_ns();
        self.robot.wake(Wake::Deadline {
            deadline_ns,
            missed: 0,
        });
        let estimate = self
            .estimates
            .receive()
            .unwrap()
            .expect("every tick publishes");
        self.seen(&estimate)
    }

    pub(crate) fn send(&mut self, pair: &Pair) {
        pair.iter().for_each(|frame| self.send_frame(frame));
    }

    pub(crate) fn send_frame(&mut self, frame: &Frame) {
        self.sender.send(frame).unwrap();
    }

    /// Frames of encoders that are well, on wheels that have turned by so much of a step, instead of one.
    pub(crate) fn send_counts(&mut self, steps: [f64; 2]) {
        let pair = self.next_pair(steps.map(|steps| steps - 1.0));
        self.send(&pair);
    }

    pub(crate) fn error(&mut self, class: ErrorClass, details: [u8; 8]) {
        self.send_frame(&Frame::error_frame(class.bit(), details));
    }

    fn seen(&self, estimate: &Estimate) -> Seen {
        let [x, y, _] = estimate.pose;
        Seen {
            health: estimate.health_of(Input::Odometry),
            bus: self.robot.account().status.bus_state(),
            // The first frames only say where counting starts.
            error_m: (x - self.way_m[0] + STEP_M).hypot(y),
        }
    }
}
