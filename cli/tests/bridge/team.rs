//! Five daemons with a home of their own, which goes with them.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use coloc_daemon::config::{
    Assist, Clock, ClockSource, Config, Initial, Member, Preset, Realtime, Robot, Scheduler, Shm,
    Sighting, Telemetry,
};
use coloc_daemon::record::{Gaps, Recording};
use coloc_drivers::can::BusSpec;
use coloc_drivers::encoder::OdometryConfig;
use coloc_shm_types::{Estimate, RobotName, Space, Status, Subscriber};
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

pub(crate) const ROBOTS: usize = 5;
pub(crate) const TRACK_M: f64 = 0.258;
pub(crate) const METRES_PER_TICK: f64 = 1e-6;
const PREFIX: &str = "bridge";
const PATIENCE: Duration = Duration::from_secs(60);

pub(crate) struct Team {
    home: TempDir,
    daemons: Vec<Child>,
    /// Whether they see one another in part.
    in_part: bool,
    /// Who leads, and who is carried.
    assist: Assist,
}

/// What hears a daemon.
pub(crate) struct Listener {
    pub(crate) estimates: Subscriber<Estimate>,
    pub(crate) statuses: Subscriber<Status>,
}

impl Team {
    /// Starts them; what each is told of where it starts is `initial`'s to say.
    pub(crate) fn start(initial: impl Fn(usize) -> Initial) -> Self {
        Self::having(false, Assist::default(), initial)
    }

    /// The same, of robots that see one another by range and bearing alone.
    pub(crate) fn in_part(initial: impl Fn(usize) -> Initial) -> Self {
        Self::having(true, Assist::default(), initial)
    }

    /// Leaders and children.
    pub(crate) fn led(assist: Assist, initial: impl Fn(usize) -> Initial) -> Self {
        Self::having(false, assist, initial)
    }

    fn having(in_part: bool, assist: Assist, initial: impl Fn(usize) -> Initial) -> Self {
        let mut team = Self {
            home: tempfile::tempdir().unwrap(),
            daemons: Vec::new(),
            in_part,
            assist,
        };
        for robot in 0..ROBOTS {
            let file = team.file(robot, "toml");
            let text = toml::to_string(&team.configuration(robot, initial(robot))).unwrap();
            std::fs::write(&file, text).unwrap();
            let mut command = Command::new(env!("CARGO_BIN_EXE_coloc"));
            command.args(["colocd", "run"]).arg(file);
            team.daemons
                .push(command.stdin(Stdio::null()).spawn().unwrap());
        }
        team
    }

    fn configuration(&self, robot: usize, initial: Initial) -> Config {
        let member = |index: usize| Member {
            name: robot_name(index),
            id: u16::try_from(index + 1).unwrap(),
        };
        let Member { name, id } = member(robot);
        let odometry =
            OdometryConfig::differential(self.bus(robot), TRACK_M, METRES_PER_TICK, 20.0);
        Config {
            team: (0..ROBOTS).map(member).collect(),
            clock: Clock {
                source: ClockSource::Boottime,
            },
            shm: Shm {
                root: self.home.path().join("shm"),
                prefix: PREFIX.into(),
                ..Shm::default()
            },
            // As the worlds of the sim are made.
            motion: Preset::Paper.motion(),
            initial,
            realtime: Realtime {
                scheduler: Scheduler::Other,
                lock_memory: false,
                ..Realtime::default()
            },
            telemetry: Telemetry {
                log_file: self.file(robot, "log"),
                record: self.file(robot, "jsonl"),
                ..Telemetry::default()
            },
            sighting: Sighting {
                heard: self.in_part,
                ..Sighting::default()
            },
            assist: self.assist.clone(),
            odometry: Some(odometry),
            ..Config::of(Robot { name, id })
        }
    }

    pub(crate) fn sees_in_part(&self) -> bool {
        self.in_part
    }

    fn file(&self, robot: usize, extension: &str) -> PathBuf {
        self.home.path().join(name(robot)).with_extension(extension)
    }

    pub(crate) fn config(&self, robot: usize) -> Config {
        Config::load(&self.file(robot, "toml")).unwrap()
    }

    pub(crate) fn bus(&self, robot: usize) -> BusSpec {
        BusSpec::Local {
            directory: self.home.path().join(format!("bus{robot}")),
        }
    }

    pub(crate) fn space(&self, who: &str) -> Space {
        Space::open(&self.home.path().join("shm"), PREFIX, who).unwrap()
    }

    /// Waits until every daemon speaks.
    pub(crate) fn listen(&mut self) -> Vec<Listener> {
        let space = self.space("listener");
        let listen = |robot| Listener {
            estimates: space.subscriber(&robot_name(robot)).unwrap(),
            statuses: space.subscriber(&robot_name(robot)).unwrap(),
        };
        let listeners: Vec<Listener> = (0..ROBOTS).map(listen).collect();
        let deadline = Instant::now() + PATIENCE;
        for (robot, listener) in listeners.iter().enumerate() {
            while listener.estimates.receive().unwrap().is_none() {
                let has_ended = self.daemons[robot].try_wait().unwrap().is_some();
                assert!(!has_ended, "robot {robot} has ended: {}", self.log(robot));
                assert!(Instant::now() < deadline, "robot {robot} is silent");
                std::thread::sleep(Duration::from_millis(5));
            }
        }
        listeners
    }

    /// Ends them in good order, so that their recordings are whole.
    pub(crate) fn stop(&mut self) {
        for daemon in &self.daemons {
            let pid = Pid::from_raw(i32::try_from(daemon.id()).unwrap()).unwrap();
            kill_process(pid, Signal::TERM).unwrap();
        }
        for mut daemon in self.daemons.drain(..) {
            assert!(daemon.wait().unwrap().success());
        }
        let left = std::fs::read_dir(self.home.path().join("shm")).map_or(0, Iterator::count);
        assert_eq!(left, 0, "left in shared memory");
    }

    /// What the daemon had to say.
    pub(crate) fn log(&self, robot: usize) -> String {
        std::fs::read_to_string(self.file(robot, "log")).unwrap()
    }

    pub(crate) fn recordings(&self) -> Vec<Recording> {
        let read = |robot| {
            let recording = Recording::read(&self.file(robot, "jsonl")).unwrap();
            assert_eq!(recording.gaps, Gaps::default(), "robot {robot}");
            recording
        };
        (0..ROBOTS).map(read).collect()
    }
}

/// Of a failed test.
impl Drop for Team {
    fn drop(&mut self) {
        for daemon in &mut self.daemons {
            // Both fail only if it is gone already.
            let _ = (daemon.kill(), daemon.wait());
        }
    }
}

fn name(robot: usize) -> String {
    format!("robot{}", robot + 1)
}

pub(crate) fn robot_name(robot: usize) -> RobotName {
    RobotName::new(&name(robot)).unwrap()
}
