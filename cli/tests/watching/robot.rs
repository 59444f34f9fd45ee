//! A robot without a daemon: it is claimed, and says estimates that follow from their number.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use coloc_shm_types::{
    Claim, Clock, Estimate, Group, GroupPage, Health, Input, Publisher, RobotName, Sender, Space,
    Unfit,
};
use tempfile::TempDir;

pub(crate) const PREFIX: &str = "watching";

/// A shared memory of its own.
pub(crate) struct Ground(TempDir);

impl Ground {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn root(&self) -> PathBuf {
        self.0.path().join("shm")
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn space(&self) -> Space {
        Space::open(&self.root(), PREFIX, "test").unwrap()
    }

    /// Every name below the root and, of this space, in `/dev/shm`.
    pub(crate) fn trace(&self) -> Vec<PathBuf> {
        let mut all = Vec::new();
        collect(&self.root(), &mut all);
        let family = self.space().full_prefix().to_owned();
        let shared = std::fs::read_dir("/dev/shm").unwrap();
        let names = shared.map(|entry| entry.unwrap().path());
        all.extend(names.filter(|path| path.to_str().unwrap().contains(&family)));
        all.sort();
        all
    }
}

fn collect(directory: &Path, all: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(&path, all);
        }
        all.push(path);
    }
}

pub(crate) fn name(robot: &str) -> RobotName {
    RobotName::new(robot).unwrap()
}

pub(crate) struct Robot {
    page: Option<GroupPage>,
    estimates: Publisher<Estimate>,
    /// [`Unfit`] and the limit.
    pub(crate) unfit: Option<(Unfit, f32)>,
    sender: Sender,
    _claim: Claim,
}

impl Robot {
    pub(crate) fn start(ground: &Ground, robot: &str, id: u16) -> Self {
        let space = ground.space();
        Self {
            _claim: space.claim_robot(&name(robot), id).unwrap(),
            estimates: space.publisher(&name(robot)).unwrap(),
            unfit: None,
            page: None,
            sender: Sender::start(id, Clock::Boottime).unwrap(),
        }
    }

    /// Which this group may read.
    pub(crate) fn start_for(ground: &Ground, robot: &str, id: u16, group: u32) -> Self {
        let mut open = Self::start(ground, robot, id);
        let group = Group::find(&group.to_string()).unwrap();
        open.page = Some(open.estimates.open_to(&group, &name(robot), id).unwrap());
        open
    }

    /// The next estimate. That one of the listeners has lost one is his affair.
    pub(crate) fn say(&mut self) {
        let mut header = self.sender.header(0);
        let tick = header.sequence;
        header.stamp_ns = stamp_ns(tick);
        let mut estimate = Estimate {
            header,
            boot_ns: stamp_ns(tick),
            tick,
            pose: [x(tick), -1.25, std::f64::consts::FRAC_PI_2],
            velocity: [0.5, 0.0, 0.25],
            independent: [0.04, 0.0, 0.0, 0.0, 0.09, 0.0, 0.0, 0.0, 0.0001],
            state: 1,
            fit: u8::from(self.unfit.is_none()),
            unfit: self.unfit.map_or(0, |(why, _)| why as u8),
            fit_limit: self.unfit.map_or(0.0, |(_, limit)| limit),
            ..Estimate::default()
        };
        estimate.health[Input::Odometry as usize] = Health::Ok as u8;
        if let Some(page) = &self.page {
            page.write(&estimate);
        }
        let _ = self.estimates.send(estimate);
    }
}

/// A real daemon, without wheels.
pub(crate) struct Daemon(Child);

impl Daemon {
    /// Once it has claimed the robot.
    pub(crate) fn start(ground: &Ground, robot: &str, id: u16) -> Self {
        let file = ground.file("robot.toml");
        let text = format!(
            "[robot]\nname = {robot:?}\nid = {id}\n[shm]\nroot = \"{}\"\nprefix = {PREFIX:?}\n\
             [realtime]\nscheduler = \"other\"\nlock_memory = false\n[telemetry]\nlog = \"error\"\n",
            ground.root().display()
        );
        std::fs::write(&file, text).unwrap();
        let child = Command::new(env!("CARGO_BIN_EXE_coloc"))
            .args(["colocd", "run"])
            .arg(&file)
            .stdin(Stdio::null())
            .spawn()
            .unwrap();
        let mut daemon = Self(child);
        // Also in a place where nobody else takes part.
        let deadline = Instant::now() + Duration::from_secs(60);
        while Space::running(&ground.root()).unwrap().is_empty() {
            assert!(daemon.0.try_wait().unwrap().is_none() && Instant::now() < deadline);
            std::thread::sleep(Duration::from_millis(5));
        }
        daemon
    }

    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    pub(crate) fn kill(&mut self) {
        let _ = self.0.kill();
        self.0.wait().unwrap();
    }
}

/// Of a failed test.
impl Drop for Daemon {
    fn drop(&mut self) {
        self.kill();
    }
}

/// When the estimate with that number was: the clock of the test does not matter.
pub(crate) fn stamp_ns(tick: u64) -> i64 {
    1_000_000_000 + 20_000_000 * i64::try_from(tick).unwrap()
}

#[allow(clippy::cast_precision_loss)] // Far below 2^53.
pub(crate) fn x(tick: u64) -> f64 {
    tick as f64 / 8.0
}
