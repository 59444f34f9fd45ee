//! A `colocd` process with a configuration and a shared-memory space of its own, which vanish with it.

use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use coloc_daemon::config::{
    self, Config, Initial, Motion, Preset, Realtime, Scheduler, Shm, Tick, Trigger, Variance,
};
use coloc_drivers::encoder::OdometryConfig;
use coloc_shm_types::{Estimate, Message, RobotName, Space, Status, Subscriber, Timing};
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

pub(crate) const TRACK_M: f64 = 0.3;
pub(crate) const METRES_PER_TICK: f64 = 1e-5;

/// Longer than anything here takes on the slowest machine; only a failure waits it out.
const PATIENCE: Duration = Duration::from_secs(20);
pub(crate) const NAME: &str = "robot1";
pub(crate) const PREFIX: &str = "can";
const MAX_SPEED_MPS: f64 = 50.0;

pub(crate) struct Robot {
    process: Child,
    estimates: Subscriber<Estimate>,
    timings: Subscriber<Timing>,
    status: Subscriber<Status>,
    /// Last, so that it is removed last.
    _directory: TempDir,
}

impl Robot {
    /// Starts it with its left and right wheel on these buses, and waits until it ticks.
    pub(crate) fn start(left: &str, right: &str, trigger: Trigger) -> Self {
        Self::configured(|root| configuration(left, right, trigger, root))
    }

    /// Starts it with a configuration for this shared-memory root, and waits until it ticks.
    pub(crate) fn configured(configuration: impl FnOnce(&Path) -> Config) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let (root, file) = (
            directory.path().join("shm"),
            directory.path().join("robot.toml"),
        );
        std::fs::write(&file, toml::to_string(&configuration(&root)).unwrap()).unwrap();
        let space = Space::open(&root, PREFIX, "test").unwrap();
        let name = RobotName::new(NAME).unwrap();
        let robot = Self {
            estimates: space.subscriber(&name).unwrap(),
            timings: space.subscriber(&name).unwrap(),
            status: space.subscriber(&name).unwrap(),
            process: Command::new(env!("CARGO_BIN_EXE_colocd-under-test"))
                .arg("run")
                .arg(file)
                .spawn()
                .unwrap(),
            _directory: directory,
        };
        robot.estimate_until("the first tick", |_| true);
        robot
    }

    /// The first estimate that is as wanted.
    pub(crate) fn estimate_until(
        &self,
        what: &str,
        wanted: impl FnMut(&Estimate) -> bool,
    ) -> Estimate {
        first(&self.estimates, what, wanted)
    }

    /// The first account of all counters that is as wanted; one comes every second.
    pub(crate) fn status_until(&self, what: &str, wanted: impl FnMut(&Status) -> bool) -> Status {
        first(&self.status, what, wanted)
    }

    /// Estimates that have come and were not looked at; every number in them is one.
    pub(crate) fn estimates(&self) -> impl Iterator<Item = Estimate> {
        std::iter::from_fn(|| self.estimates.receive().unwrap()).inspect(assert_finite)
    }

    /// What ticks have told of their time and was not looked at.
    pub(crate) fn timings(&self) -> impl Iterator<Item = Timing> {
        std::iter::from_fn(|| self.timings.receive().unwrap())
    }

    /// The first such that is as wanted; they come some time after their ticks.
    pub(crate) fn timing_until(&self, what: &str, wanted: impl FnMut(&Timing) -> bool) -> Timing {
        first(&self.timings, what, wanted)
    }

    /// How often the thread that ticks has gone to sleep so far: a wake-up each.
    pub(crate) fn sleeps(&self) -> u64 {
        let threads = std::fs::read_dir(format!("/proc/{}/task", self.process.id())).unwrap();
        let status =
            |thread: std::fs::DirEntry| std::fs::read_to_string(thread.path().join("status"));
        let ticking = threads
            .map(|thread| status(thread.unwrap()).unwrap())
            .find(|status| status.starts_with("Name:\tcolocd-tick\n"));
        let sleeps = ticking.unwrap();
        let sleeps = sleeps
            .lines()
            .find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
        sleeps.unwrap().trim().parse().unwrap()
    }

    /// Stops it, as a debugger or a machine without time would.
    pub(crate) fn pause(&self) {
        kill_process(Pid::from_child(&self.process), Signal::STOP).unwrap();
    }

    /// Lets it go on.
    pub(crate) fn go_on(&self) {
        kill_process(Pid::from_child(&self.process), Signal::CONT).unwrap();
    }

    /// Ends it as a person would; it obeys.
    pub(crate) fn end(mut self) {
        kill_process(Pid::from_child(&self.process), Signal::TERM).unwrap();
        assert!(self.process.wait().unwrap().success());
    }
}

fn first<M: Message>(port: &Subscriber<M>, what: &str, mut wanted: impl FnMut(&M) -> bool) -> M {
    let deadline = Instant::now() + PATIENCE;
    let mut last = None;
    loop {
        match port.receive().unwrap() {
            Some(message) if wanted(&message) => return message,
            Some(message) => last = Some(message),
            None => std::thread::sleep(Duration::from_millis(1)),
        }
        assert!(
            Instant::now() < deadline,
            "{what}: not within {PATIENCE:?}; last: {last:?}"
        );
    }
}

fn assert_finite(estimate: &Estimate) {
    let Estimate {
        pose,
        velocity,
        independent,
        dependent,
        ..
    } = estimate;
    let numbers = [&pose[..], velocity, independent, dependent].concat();
    assert!(
        numbers.iter().all(|number| number.is_finite()),
        "{estimate:?}"
    );
}

impl Drop for Robot {
    fn drop(&mut self) {
        let _ = (self.process.kill(), self.process.wait()); // Ended already, unless the test has failed.
    }
}

/// Wheels without noise: where the robot believes to be is then plain geometry.
pub(crate) fn configuration(left: &str, right: &str, trigger: Trigger, root: &Path) -> Config {
    let name = RobotName::new(NAME).unwrap();
    Config {
        tick: Tick {
            trigger,
            ..Tick::default()
        },
        shm: Shm {
            root: root.into(),
            prefix: PREFIX.into(),
            ..Shm::default()
        },
        initial: Initial {
            sigma: [0.1, 0.1, 0.0],
            ..Initial::default()
        },
        motion: Motion {
            forward: Variance::default(),
            turning: Variance::default(),
            outage_variance: [0.0; 3],
            ..Preset::Paper.motion()
        },
        odometry: Some(wheels(left, right)),
        realtime: ordinary(),
        ..Config::of(config::Robot { name, id: 1 })
    }
}

/// A wheel on each of two buses, or both on one.
fn wheels(left: &str, right: &str) -> OdometryConfig {
    let bus = |spec: &str| spec.parse().unwrap();
    let mut odometry =
        OdometryConfig::differential(bus(left), TRACK_M, METRES_PER_TICK, MAX_SPEED_MPS);
    if left != right {
        odometry.buses.push(bus(right));
        odometry.wheels.iter_mut().for_each(|it| it.right.bus = 1);
    }
    odometry
}

/// Nothing is asked of the operating system.
pub(crate) fn ordinary() -> Realtime {
    Realtime {
        scheduler: Scheduler::Other,
        lock_memory: false,
        ..Realtime::default()
    }
}
