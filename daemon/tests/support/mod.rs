//! A robot's site: a directory of its own with configuration, shared-memory root and bus. Everything is waited for
//! with a deadline.
#![allow(dead_code, clippy::unwrap_used)] // Each test binary uses its part; what fails here fails the test.

use std::fmt::Debug;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use coloc_daemon::config::Config;
use coloc_daemon::saved::Saved;
use coloc_drivers::can::{BusSpec, Sender};
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{Estimate, Message, RobotName, Space, Status, Subscriber};
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

const METRES_PER_TICK: f64 = 1e-5;
const ORDINARY: &str = "[realtime]\nscheduler = \"other\"\nlock_memory = false\n";
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);
const PERIOD: Duration = Duration::from_millis(20);

pub(crate) struct Site {
    directory: TempDir,
    config: String,
    robot: RobotName,
}

/// Wheels that hardly err: a mean over uncertain headings would be shorter than the way.
impl Site {
    /// In `lines`, `{at}` is the site's directory.
    pub(crate) fn new(robot: &str, lines: &str) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let at = directory.path().display();
        let lines = lines.replace("{at}", &at.to_string());
        let state = format!("[telemetry]\nstate_file = \"{at}/belief.toml\"\n");
        let lines = match lines.split_once("[telemetry]\n") {
            Some((before, after)) => format!("{before}{state}{after}"),
            None => format!("{lines}\n{state}"),
        };
        let config = format!(
            "{lines}\n[robot]\nname = \"{robot}\"\nid = 1\n\
             [shm]\nroot = \"{at}/shm\"\nprefix = \"test\"\n\
             [odometry]\nbuses = [\"local:{at}/bus\"]\nmax_speed_mps = 5.0\n\
             [odometry.wheels]\ntrack_m = 0.3\n\
             left = {{ message = \"WheelLeft\", signal = \"Ticks\", metres_per_tick = {METRES_PER_TICK} }}\n\
             right = {{ message = \"WheelRight\", signal = \"Ticks\", metres_per_tick = {METRES_PER_TICK} }}\n\
             [motion]\npreset = \"paper\"\nforward = {{ b = 1e-6 }}\nturning = {{ a = 1e-9 }}\noutage_variance = [1e-6, 1e-6, 1e-9]\n\
             {}",
            if lines.contains("[realtime]") {
                ""
            } else {
                ORDINARY
            }
        );
        std::fs::write(directory.path().join("robot.toml"), &config).unwrap();
        Self {
            directory,
            config,
            robot: RobotName::new(robot).unwrap(),
        }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    pub(crate) fn config(&self) -> &str {
        &self.config
    }

    pub(crate) fn config_path(&self) -> PathBuf {
        self.directory.path().join("robot.toml")
    }

    pub(crate) fn root(&self) -> PathBuf {
        self.directory.path().join("shm")
    }

    pub(crate) fn robot(&self) -> RobotName {
        self.robot.clone()
    }

    pub(crate) fn start(&self) -> Daemon {
        Daemon::spawn(&mut self.run_command())
    }

    /// What [`Self::start`] starts.
    pub(crate) fn run_command(&self) -> Command {
        Daemon::command(&["run", self.config_path().to_str().unwrap()])
    }

    /// Runs a daemon that is expected to end by itself: its exit code and what it said.
    pub(crate) fn try_run(&self) -> (Option<i32>, String) {
        let mut command = Daemon::command(&["run", self.config_path().to_str().unwrap()]);
        let mut child = Daemon(command.stderr(Stdio::piped()).spawn().unwrap());
        let code = child.wait();
        let mut said = String::new();
        std::io::Read::read_to_string(&mut child.0.stderr.take().unwrap(), &mut said).unwrap();
        (code, said)
    }

    pub(crate) fn bus(&self) -> PathBuf {
        self.directory.path().join("bus")
    }

    pub(crate) fn space(&self) -> Space {
        Space::open(&self.root(), "test", "test").unwrap()
    }

    pub(crate) fn listen(&self) -> Listener<Estimate> {
        self.listen_to()
    }

    pub(crate) fn listen_to<M: Message>(&self) -> Listener<M> {
        Listener(self.space().subscriber(&self.robot).unwrap())
    }

    pub(crate) fn status_until(&self, what: &str, condition: impl Fn(&Status) -> bool) -> Status {
        self.listen_to().until(what, condition)
    }

    pub(crate) fn saved_until(&self, what: &str, condition: impl Fn(&Saved) -> bool) {
        let config = Config::load(&self.config_path()).unwrap();
        let read = || -> Option<Saved> {
            toml::from_str(&std::fs::read_to_string(config.state().ok()?.path()).ok()?).ok()
        };
        wait_for(what, || {
            read()
                .filter(|saved| condition(saved))
                .ok_or_else(|| read().map(|saved| saved.pose))
        });
    }

    /// The wheels, once the daemon listens to them.
    pub(crate) fn drive(&self) -> Drive {
        let bus = self.bus();
        let _: std::io::Result<_> = wait_for("a listener on the bus", || {
            std::fs::read_dir(&bus)
                .ok()
                .and_then(|mut entries| entries.next())
                .ok_or(())
        });
        let sender = Sender::open(&BusSpec::Local { directory: bus }).unwrap();
        Drive {
            sender,
            frames: WheelFrames::new(METRES_PER_TICK),
            way_m: 0.0,
        }
    }

    pub(crate) fn assert_nothing_left(&self) {
        let Ok(entries) = std::fs::read_dir(self.root()) else {
            return;
        };
        let left: Vec<_> = entries.map(|it| it.unwrap().file_name()).collect();
        assert!(left.is_empty(), "{left:?} in {}", self.root().display());
    }
}

/// After a failed test, what its killed daemon has left.
impl Drop for Site {
    fn drop(&mut self) {
        if self.root().exists() {
            let _ = Space::open(&self.root(), "test", "test");
        }
    }
}

pub(crate) struct Drive {
    sender: Sender,
    frames: WheelFrames,
    way_m: f64,
}

impl Drive {
    /// Both wheels at `speed_mps`, for so many frames of each, at 50 Hz.
    pub(crate) fn straight(&mut self, count: u32, speed_mps: f64) {
        let start = Instant::now();
        for index in 0..count {
            std::thread::sleep((start + PERIOD * index).saturating_duration_since(Instant::now()));
            self.way_m += speed_mps * PERIOD.as_secs_f64();
            for frame in self.frames.encode(self.way_m, self.way_m) {
                self.sender.send(&frame).unwrap();
            }
        }
    }

    /// Long enough for the last velocity to be that of a standing robot.
    pub(crate) fn stand(&mut self) {
        self.straight(5, 0.0);
    }

    /// Way since the first frame, which only says where counting starts.
    pub(crate) fn way_m(&self) -> f64 {
        self.way_m - 0.5 * PERIOD.as_secs_f64()
    }
}

pub(crate) struct Listener<M: Message>(Subscriber<M>);

impl<M: Message> Listener<M> {
    pub(crate) fn until(&self, what: &str, condition: impl Fn(&M) -> bool) -> M {
        let mut last = None;
        let mut next = || {
            last = self.0.receive().unwrap().or(last);
            last.filter(|message| condition(message)).ok_or(last)
        };
        wait_for(what, &mut next)
    }
}

pub(crate) struct Daemon(Child);

impl Daemon {
    pub(crate) fn command(arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_colocd-in-daemon-tests"));
        command.args(arguments);
        command
    }

    pub(crate) fn spawn(command: &mut Command) -> Self {
        Self(command.spawn().unwrap())
    }

    /// What it says there, if it was started so.
    pub(crate) fn standard_error(&mut self) -> std::process::ChildStderr {
        self.0.stderr.take().unwrap()
    }

    pub(crate) fn pid(&self) -> u32 {
        self.0.id()
    }

    /// SIGTERM: it must end, and with 0.
    pub(crate) fn terminate(&mut self) {
        self.signal(Signal::TERM);
        assert_eq!(self.wait(), Some(0));
    }

    /// SIGINT: likewise.
    pub(crate) fn interrupt(&mut self) {
        self.signal(Signal::INT);
        assert_eq!(self.wait(), Some(0));
    }

    pub(crate) fn kill(&mut self) {
        self.signal(Signal::KILL);
        assert_eq!(self.wait(), None);
    }

    pub(crate) fn signal(&self, signal: Signal) {
        let pid = Pid::from_raw(i32::try_from(self.0.id()).unwrap()).unwrap();
        kill_process(pid, signal).unwrap();
    }

    /// For its end: the exit status, `None` if a signal killed it.
    pub(crate) fn wait(&mut self) -> Option<i32> {
        wait_for("the end of the daemon", || {
            self.0.try_wait().unwrap().ok_or(())
        })
        .code()
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        // It has ended already, unless a test has failed.
        let _ = (self.0.kill(), self.0.wait());
    }
}

/// Asks again and again, for a bounded time; an answer of `Err` is what the last one was like.
pub(crate) fn wait_for<T, E: Debug>(what: &str, mut ask: impl FnMut() -> Result<T, E>) -> T {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match ask() {
            Ok(answer) => return answer,
            Err(last) => assert!(
                Instant::now() < deadline,
                "{what}: not within {PATIENCE:?}; last: {last:?}"
            ),
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
