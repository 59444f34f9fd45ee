//! A world whose ticks are driven by hand, with a clock of the test's own.
#![allow(dead_code, clippy::unwrap_used)] // Each test binary uses its part; what fails here fails the test.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use coloc_daemon::clock::{Reading, TimeSource};
use coloc_daemon::config::Config;
use coloc_daemon::event::{Event, Link};
use coloc_daemon::record::{Record, Step};
use coloc_daemon::tick::{Outcome, Robot};
use coloc_daemon::wait::Wake;
use coloc_drivers::can::{BusSpec, Sender};
use coloc_shm_types::{
    Clock, Estimate, Header, Message, Publisher, RobotName, Space, Subscriber, Timing,
};
use tempfile::TempDir;

pub(crate) const SECOND: i64 = 1_000_000_000;
pub(crate) const PERIOD: i64 = SECOND / 50;
pub(crate) const METRES_PER_TICK: f64 = 1e-4;
pub(crate) const START: i64 = 1_000 * SECOND;

/// Two clocks that run only when told to, and step when told to.
#[derive(Clone, Default)]
pub(crate) struct TestTime(Arc<(AtomicI64, AtomicI64)>);

impl TestTime {
    pub(crate) fn run(&self, nanos: i64) {
        self.0.0.fetch_add(nanos, Ordering::Relaxed);
        self.0.1.fetch_add(nanos, Ordering::Relaxed);
    }

    pub(crate) fn step(&self, nanos: i64) {
        self.0.1.fetch_add(nanos, Ordering::Relaxed);
    }

    pub(crate) fn read_boot(&self) -> i64 {
        self.read().boot_ns
    }

    pub(crate) fn realtime(&self) -> i64 {
        self.read().realtime_ns
    }
}

impl TimeSource for TestTime {
    fn read(&self) -> Reading {
        let realtime_ns = self.0.1.load(Ordering::Relaxed);
        Reading {
            boot_ns: self.0.0.load(Ordering::Relaxed),
            realtime_ns,
            tai_ns: realtime_ns,
            width_ns: 0,
        }
    }
}

pub(crate) struct World {
    pub(crate) directory: TempDir,
    pub(crate) space: Space,
    pub(crate) time: TestTime,
}

/// A robot, and an ear on what it publishes.
pub(crate) struct Subject {
    pub(crate) robot: Robot,
    pub(crate) estimates: Subscriber<Estimate>,
    pub(crate) time: TestTime,
    pub(crate) link: Arc<Link>,
}

pub(crate) fn name(robot: &str) -> RobotName {
    RobotName::new(robot).unwrap()
}

impl World {
    pub(crate) fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let space = Space::open(&directory.path().join("shm"), "tick", "tick").unwrap();
        let time = TestTime::default();
        time.run(START);
        Self {
            directory,
            space,
            time,
        }
    }

    pub(crate) fn robot(&self, robot: &str, id: u16, lines: &str) -> Subject {
        self.robot_under(Box::new(self.time.clone()), robot, id, lines)
    }

    /// One that lives under other clocks than the world's.
    pub(crate) fn robot_under(
        &self,
        time: Box<dyn TimeSource>,
        robot: &str,
        id: u16,
        lines: &str,
    ) -> Subject {
        let team = "[[team]]\nname = \"a\"\nid = 1\n[[team]]\nname = \"b\"\nid = 2\n";
        let text = format!("{team}[robot]\nname = \"{robot}\"\nid = {id}\n{lines}");
        let config = Config::parse(&text, Path::new("tick.toml")).unwrap();
        self.open(time, &config)
    }

    pub(crate) fn robot_of(&self, config: &Config) -> Subject {
        self.open(Box::new(self.time.clone()), config)
    }

    fn open(&self, time: Box<dyn TimeSource>, config: &Config) -> Subject {
        let link = Arc::new(Link::new());
        let estimates = self.space.subscriber(&config.robot.name).unwrap();
        let robot = Robot::open(config, &self.space, time, Arc::clone(&link)).unwrap();
        Subject {
            robot,
            estimates,
            time: self.time.clone(),
            link,
        }
    }

    pub(crate) fn publisher<M: Message>(&self, robot: &str) -> Publisher<M> {
        self.space.publisher(&name(robot)).unwrap()
    }

    /// `[odometry]` for two wheels on a local bus of this world.
    pub(crate) fn wheels(&self) -> String {
        let wheel = |message| {
            format!(
                "{{ message = \"{message}\", signal = \"Ticks\", metres_per_tick = {METRES_PER_TICK} }}"
            )
        };
        format!(
            "[odometry]\nbuses = [\"{}\"]\nmax_speed_mps = 5.0\n[odometry.wheels]\ntrack_m = 0.3\nleft = {}\nright = {}\n",
            self.bus(),
            wheel("WheelLeft"),
            wheel("WheelRight")
        )
    }

    /// The encoders' end of that bus.
    pub(crate) fn sender(&self) -> Sender {
        Sender::open(&self.bus()).unwrap()
    }

    fn bus(&self) -> BusSpec {
        BusSpec::Local {
            directory: self.directory.path().join("bus"),
        }
    }

    pub(crate) fn header(&self, sequence: u64) -> Header {
        Header {
            stamp_ns: self.time.realtime(),
            session: 1,
            sequence,
            clock: Clock::Realtime as u8,
            ..Header::default()
        }
    }
}

impl Subject {
    /// What the newest tick has told of its time.
    pub(crate) fn timing(&self) -> Option<Timing> {
        let events = std::iter::from_fn(|| self.link.next_event());
        let timings = events.filter_map(|event| match event {
            Event::Timing(timing) => Some(timing),
            _ => None,
        });
        timings.last()
    }

    /// The ticks that were recorded since this was asked last: what the estimator did, and with how many inputs.
    pub(crate) fn recorded_ticks(&self) -> Vec<(Step, usize)> {
        let events = std::iter::from_fn(|| self.link.next_event());
        let ticks = events.filter_map(|event| match event {
            Event::Recorded(Record::Tick { step, inputs, .. }) => Some((step, inputs)),
            _ => None,
        });
        ticks.collect()
    }

    /// A period passes, and a tick on time.
    pub(crate) fn tick(&mut self) -> Estimate {
        self.time.run(PERIOD);
        let deadline_ns = self.time.now_ns();
        assert_eq!(
            self.robot.wake(Wake::Deadline {
                deadline_ns,
                missed: 0
            }),
            Outcome::Ticked
        );
        self.estimates.receive().unwrap().expect("a tick publishes")
    }
}

pub(crate) fn diagonal(variances: [f64; 3]) -> [f64; 9] {
    let [a, b, c] = variances;
    [a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c]
}
