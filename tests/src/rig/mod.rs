//! A real robot (the daemon's own tick, buses and shared memory) whose time, wheels and bus are in a test's hands.

mod bus;
mod clock;
mod descriptor;
mod follow;
mod wheels;

use std::path::Path;
use std::sync::Arc;

use coloc_counting::{Calls, calls_during};
use coloc_daemon::config::{self, Config, Initial, Motion, Preset, Shm, Variance};
use coloc_daemon::event::Link;
use coloc_daemon::tick::{Outcome, Robot};
use coloc_daemon::wait::Wake;
use coloc_drivers::can::{BusSpec, Frame};
use coloc_drivers::encoder::OdometryConfig;
use coloc_shm_types::{Estimate, RobotName, Space, Status, Subscriber};
use tempfile::TempDir;

pub use bus::Line;
pub use clock::{Clock, Stamps};
pub use follow::follow;
pub use wheels::{METRES_PER_TICK, TRACK_M, WAY_PER_PERIOD_M, Wheels, altered};

/// From one tick to the next \[ns\].
pub const PERIOD_NS: i64 = 20_000_000;

/// The robot and everything around it.
pub struct Rig {
    /// The time of day.
    pub clock: Clock,
    /// What the robot really does.
    pub wheels: Wheels,
    /// Frames that are on their way.
    pub late: std::collections::VecDeque<[Frame; 2]>,
    bench: bus::Bench,
    robot: Robot,
    estimates: Subscriber<Estimate>,
    /// The descriptor of the robot's CAN socket, as long as nobody has touched it.
    socket: i32,
    /// Last, so that it is removed last.
    _directory: TempDir,
}

/// What came of a tick.
#[derive(Copy, Clone, Debug)]
pub struct Ticked {
    /// As it was published.
    pub estimate: Estimate,
    /// What the real-time thread asked of the allocator.
    pub calls: Calls,
}

impl Rig {
    /// A robot at the origin; `line` makes the bus from a directory of the rig's own. Its encoders start at `first_ticks`.
    #[must_use]
    pub fn new(line: impl FnOnce(&Path) -> Line, first_ticks: u32, stamps: Stamps) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let line = line(directory.path());
        let bench = bus::Bench::new(line.clone());
        let config = config(&directory.path().join("shm"), &line.spec());
        let space = Space::open(&config.shm.root, &config.shm.prefix, "rig").unwrap();
        let estimates = space
            .subscriber(&RobotName::new("robot1").unwrap())
            .unwrap();
        let clock = Clock::new(stamps);
        let before = descriptor::sockets();
        let robot = Robot::open(
            &config,
            &space,
            Box::new(clock.clone()),
            Arc::new(Link::new()),
        )
        .unwrap();
        Self {
            clock,
            wheels: Wheels::new(first_ticks),
            late: std::collections::VecDeque::new(),
            bench,
            robot,
            estimates,
            socket: descriptor::the_new_one(&before, &line),
            _directory: directory,
        }
    }

    /// A period passes for the wheels: what they send, if it is sent.
    pub fn turn(&mut self) -> [Frame; 2] {
        self.wheels.turn()
    }

    /// Sends what arrives before the next tick.
    pub fn send(&mut self, frames: &[Frame]) {
        for frame in frames {
            self.bench.send(frame);
        }
    }

    /// The next tick comes, exactly in time.
    pub fn tick(&mut self) -> Ticked {
        self.clock.run(PERIOD_NS);
        let wake = Wake::Deadline {
            deadline_ns: coloc_daemon::clock::TimeSource::now_ns(&self.clock),
            missed: 0,
        };
        let (outcome, calls) = calls_during(|| self.robot.wake(wake));
        assert_eq!(outcome, Outcome::Ticked);
        let estimate = self.estimates.receive().unwrap();
        Ticked {
            estimate: estimate.expect("a tick publishes"),
            calls,
        }
    }

    /// The robot's books.
    #[must_use]
    pub fn status(&self) -> Status {
        self.robot.account().status()
    }

    /// Switches the interface.
    pub fn switch(&mut self, on: bool) {
        self.bench.switch(on);
    }

    /// Takes the bus away, or makes it again.
    pub fn exist(&mut self, exists: bool) {
        self.bench.exist(exists);
    }

    /// Takes from the robot's socket what it has asked the kernel for: so many bytes remain.
    pub fn limit_socket(&mut self, bytes: usize) {
        descriptor::limit(self.socket, bytes);
    }

    /// Closes the robot's own socket behind its back. `reuse`: its number then means something else.
    pub fn close_socket(&mut self, reuse: bool) {
        descriptor::close(self.socket, reuse);
    }
}

/// Turning is known exactly and the first heading too, so that where the robot believes to be is plain geometry; along
/// its way it is as uncertain as a robot is.
fn config(root: &Path, bus: &BusSpec) -> Config {
    let name = RobotName::new("robot1").unwrap();
    let odometry = OdometryConfig::differential(bus.clone(), TRACK_M, METRES_PER_TICK, 5.0);
    Config {
        shm: Shm {
            root: root.into(),
            prefix: "rig".into(),
            ..Shm::default()
        },
        initial: Initial {
            sigma: [0.1, 0.1, 0.0],
            ..Initial::default()
        },
        motion: Motion {
            forward: Variance {
                a: 1e-4,
                ..Variance::default()
            },
            turning: Variance::default(),
            outage_variance: [1.0, 1.0, 0.0],
            ..Preset::Paper.motion()
        },
        odometry: Some(odometry),
        ..Config::of(config::Robot { name, id: 1 })
    }
}
