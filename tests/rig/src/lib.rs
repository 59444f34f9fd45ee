//! Robots, their shared memory and the programs beside `colocd`, for the tests of these programs. What cannot be is a test that failed:
//! everything here panics.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc)] // It is a part of tests.

pub mod page;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use coloc_shm_types::{DriverStatus, Message, Publisher, RobotName, Space, Subscriber};
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

/// A loaded machine takes its time.
pub const PATIENCE: Duration = Duration::from_secs(90);

/// Robots, their shared memory, and the programs that were started.
#[derive(Debug)]
pub struct Rig {
    home: TempDir,
    space: Space,
    prefix: &'static str,
    program: &'static str,
    programs: Vec<Child>,
}

impl Rig {
    /// With shared memory of its own, for the program at `program`.
    #[must_use]
    pub fn new(prefix: &'static str, program: &'static str) -> Self {
        let home = tempfile::tempdir().unwrap();
        let space = Space::open(&home.path().join("shm"), prefix, "test").unwrap();
        Self {
            home,
            space,
            prefix,
            program,
            programs: Vec::new(),
        }
    }

    /// Its shared memory.
    #[must_use]
    pub fn space(&self) -> &Space {
        &self.space
    }

    /// Where a file of that name is.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.home.path().join(name)
    }

    /// Writes the configuration of the robot `own` of `team`, whose numbers count from 1.
    pub fn configure(&self, own: &str, team: &[&str], more: &str) {
        let id = 1 + team.iter().position(|name| *name == own).unwrap();
        let mut text = format!("[robot]\nname = \"{own}\"\nid = {id}\n");
        for (name, id) in team.iter().zip(1..).filter(|(name, _)| **name != own) {
            write!(text, "[[team]]\nname = \"{name}\"\nid = {id}\n").unwrap();
        }
        let (root, prefix) = (self.path("shm"), self.prefix);
        let root = root.display();
        write!(
            text,
            "[shm]\nroot = \"{root}\"\nprefix = \"{prefix}\"\n{more}"
        )
        .unwrap();
        std::fs::write(self.configuration(own), text).unwrap();
    }

    /// Where the configuration of a robot is.
    #[must_use]
    pub fn configuration(&self, robot: &str) -> PathBuf {
        self.path(format!("{robot}.toml"))
    }

    /// The program with a command for a robot.
    #[must_use]
    pub fn command(&self, word: &str, robot: &str) -> Command {
        let mut command = Command::new(self.program);
        command.arg(word).arg(self.configuration(robot));
        command
    }

    /// Starts a program; its process.
    pub fn start(&mut self, mut command: Command) -> u32 {
        let program = command.stderr(Stdio::piped()).spawn().unwrap();
        self.programs.push(program);
        self.programs.last().unwrap().id()
    }

    /// Status and words of the last that was started, once it has ended.
    pub fn ended(&mut self) -> Output {
        self.programs.pop().unwrap().wait_with_output().unwrap()
    }

    /// Whether the last that was started has ended.
    pub fn is_over(&mut self) -> bool {
        let last = self.programs.last_mut().unwrap();
        last.try_wait().unwrap().is_some()
    }

    /// Status and words of a command that ends by itself: standard output, then standard error.
    #[must_use]
    pub fn said(&self, word: &str, robot: &str, more: &[&str]) -> (Option<i32>, String) {
        let output = self.command(word, robot).args(more).output().unwrap();
        let said = [output.stdout, output.stderr].map(|it| String::from_utf8(it).unwrap());
        (output.status.code(), said.concat())
    }

    /// A mouth on a channel of a robot.
    #[must_use]
    pub fn publisher<M: Message>(&self, robot: &str) -> Publisher<M> {
        let robot = RobotName::new(robot).unwrap();
        self.space.publisher(&robot).unwrap()
    }

    /// An ear on a channel of a robot.
    #[must_use]
    pub fn subscriber<M: Message>(&self, robot: &str) -> Subscriber<M> {
        let robot = RobotName::new(robot).unwrap();
        self.space.subscriber(&robot).unwrap()
    }

    /// A second program for the same robot is refused, while the first goes on.
    pub fn assert_alone(&mut self, word: &str, robot: &str) {
        let statuses = self.subscriber::<DriverStatus>(robot);
        let process = self.start(self.command(word, robot));
        assert!(statuses.wait(PATIENCE).unwrap().is_some());
        let (status, said) = self.said(word, robot, &[]);
        let told = format!("already runs as process {process}");
        assert!(status == Some(5) && said.contains(&told), "{said}");
        assert!(statuses.wait(PATIENCE).unwrap().is_some());
    }

    /// SIGTERM to all; status and words of each.
    #[must_use]
    pub fn stop(mut self) -> Vec<Output> {
        let programs = std::mem::take(&mut self.programs);
        let ended = programs.into_iter().map(|program| {
            let pid = Pid::from_raw(program.id().cast_signed()).unwrap();
            // One that plays a recording may be at its end already.
            let _ = kill_process(pid, Signal::TERM);
            program.wait_with_output().unwrap()
        });
        ended.collect()
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        for program in &mut self.programs {
            let _ = program.kill();
            let _ = program.wait();
        }
    }
}

/// Lets `voices` speak again and again, so far apart, until `heard` hears what it wants.
pub fn until<V, T>(
    voices: &mut V,
    apart: Duration,
    mut speak: impl FnMut(&mut V),
    mut heard: impl FnMut(&V) -> Option<T>,
) -> T {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        speak(voices);
        let turn = Instant::now();
        while turn.elapsed() < apart {
            if let Some(heard) = heard(voices) {
                return heard;
            }
            std::thread::yield_now();
        }
    }
    panic!("nothing was heard for {PATIENCE:?}");
}
