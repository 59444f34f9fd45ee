//! The daemons: one process for each robot, started, watched and ended here.

use std::fs::File;
use std::io;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use super::DemoError;
use super::links::{self, LINK};
use crate::daemon::{self, PARENT_VARIABLE};

/// How long a daemon may take to leave shared memory as it found it.
const PATIENCE: Duration = Duration::from_secs(3);

/// A program that this one can be.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Program {
    Daemon,
    Laser,
    Link,
}

impl Program {
    fn name(self) -> &'static str {
        match self {
            Self::Daemon => daemon::NAME,
            Self::Laser => daemon::LASER,
            Self::Link => LINK,
        }
    }

    /// What is to be executed for it, and with what.
    fn command(self) -> Result<(PathBuf, Vec<String>), DemoError> {
        if self == Self::Link {
            return Ok((links::program()?, vec!["run".into()]));
        }
        let own = std::env::current_exe().map_err(DemoError::spawn)?;
        Ok((own, vec![self.name().into(), "run".into()]))
    }

    /// What follows the robot's name in that of its log.
    fn log(self) -> &'static str {
        match self {
            Self::Daemon => "log",
            Self::Laser => "laser.log",
            Self::Link => "link.log",
        }
    }
}

/// A process for each robot; all end with it.
pub(crate) struct Fleet {
    daemons: Vec<Daemon>,
}

/// One robot's process.
pub(crate) struct Daemon {
    command: Command,
    child: Child,
    exit: Option<ExitStatus>,
    log: PathBuf,
}

impl Fleet {
    /// Starts the program for each configuration; what they log goes into `logs`. Each is in the network namespace that `networks` has for
    /// it, if it has one.
    pub(crate) fn start(
        program: Program,
        files: &[PathBuf],
        networks: &[PathBuf],
        logs: &Path,
    ) -> Result<Self, DemoError> {
        Self::start_each(program, files, networks, logs, &|_| Vec::new())
    }

    /// The same, each robot's with arguments of its own.
    pub(crate) fn start_each(
        program: Program,
        files: &[PathBuf],
        networks: &[PathBuf],
        logs: &Path,
        own: &dyn Fn(usize) -> Vec<String>,
    ) -> Result<Self, DemoError> {
        let mut fleet = Self {
            daemons: Vec::new(),
        };
        for (robot, file) in files.iter().enumerate() {
            let log = logs.join(
                file.with_extension(program.log())
                    .file_name()
                    .unwrap_or_default(),
            );
            let (executed, arguments) = program.command()?;
            let mut command = within(networks.get(robot), executed);
            command.args(arguments).args(own(robot)).arg(file);
            fleet.daemons.push(Daemon::start(command, &log)?);
        }
        Ok(fleet)
    }

    /// One process of another program.
    pub(crate) fn of_one(
        program: &Path,
        arguments: &[String],
        log: &Path,
    ) -> Result<Self, DemoError> {
        let mut command = Command::new(program);
        command.args(arguments);
        Ok(Self {
            daemons: vec![Daemon::start(command, log)?],
        })
    }

    /// The process of each robot, or how it ended.
    pub(crate) fn look(&mut self) -> Vec<Result<u32, ExitStatus>> {
        self.daemons.iter_mut().map(Daemon::look).collect()
    }

    /// Kills the robot's process (SIGKILL).
    pub(crate) fn kill(&mut self, robot: usize) {
        if let Some(daemon) = self.daemons.get_mut(robot) {
            daemon.kill();
        }
    }

    /// Starts it again, if it has ended.
    pub(crate) fn start_again(&mut self, robot: usize) -> Result<(), DemoError> {
        let ended = self.daemons.get_mut(robot);
        match ended.filter(|daemon| daemon.exit.is_some()) {
            Some(daemon) => daemon.start_again().map_err(DemoError::spawn),
            None => Ok(()),
        }
    }

    /// What the robot's daemon said last.
    pub(crate) fn last_words(&self, robot: usize) -> String {
        self.words(robot)
            .lines()
            .rfind(|line| !line.trim().is_empty())
            .unwrap_or("it said nothing")
            .trim()
            .to_owned()
    }

    /// All that it said.
    pub(crate) fn words(&self, robot: usize) -> String {
        self.daemons
            .get(robot)
            .and_then(|daemon| std::fs::read_to_string(&daemon.log).ok())
            .unwrap_or_default()
    }

    /// Asks all to end, waits for them, and kills who does not. Says which had to be killed.
    pub(crate) fn stop(&mut self) -> Vec<usize> {
        self.daemons
            .iter()
            .filter(|daemon| daemon.exit.is_none())
            .for_each(|daemon| signal(daemon.child.id(), Signal::TERM));
        let deadline = Instant::now() + PATIENCE;
        while self.look().iter().any(Result::is_ok) && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(10));
        }
        let stubborn = |(robot, daemon): (usize, &mut Daemon)| daemon.kill().then_some(robot);
        self.daemons
            .iter_mut()
            .enumerate()
            .filter_map(stubborn)
            .collect()
    }
}

impl Drop for Fleet {
    fn drop(&mut self) {
        self.daemons.iter_mut().for_each(|daemon| {
            daemon.kill();
        });
    }
}

impl Daemon {
    fn start(mut command: Command, log: &Path) -> Result<Self, DemoError> {
        let output = File::create(log).map_err(DemoError::spawn)?;
        let child = spawn(&mut command, output).map_err(DemoError::spawn)?;
        Ok(Self {
            command,
            child,
            exit: None,
            log: log.into(),
        })
    }

    /// Its log goes on.
    fn start_again(&mut self) -> io::Result<()> {
        let output = File::options().append(true).open(&self.log)?;
        self.child = spawn(&mut self.command, output)?;
        self.exit = None;
        Ok(())
    }

    fn look(&mut self) -> Result<u32, ExitStatus> {
        if self.exit.is_none() {
            self.exit = self.child.try_wait().ok().flatten();
        }
        self.exit.map_or(Ok(self.child.id()), Err)
    }

    /// Whether there was somebody to kill.
    fn kill(&mut self) -> bool {
        let alive = self.look().is_ok();
        if alive {
            // Both fail only if it is gone already.
            let _ = self.child.kill();
            self.exit = self.child.wait().ok();
        }
        alive
    }
}

/// `nsenter` becomes the program, so that the process is the same.
fn within(network: Option<&PathBuf>, program: PathBuf) -> Command {
    let Some(network) = network else {
        return Command::new(program);
    };
    let mut command = Command::new(ENTER);
    command.arg(enter(network)).arg("--").arg(program);
    command
}

/// Of util-linux.
pub(crate) const ENTER: &str = "nsenter";

/// Its argument.
pub(crate) fn enter(network: &Path) -> String {
    format!("--net={}", network.display())
}

fn spawn(command: &mut Command, output: File) -> io::Result<Child> {
    command
        .env(PARENT_VARIABLE, std::process::id().to_string())
        // A Ctrl-C is for the demo, which then ends them in order.
        .process_group(0)
        .stdin(Stdio::null())
        .stdout(output.try_clone()?)
        .stderr(output)
        .spawn()
}

/// Sends `signal` to a process that is known to be one of the demo's daemons.
pub(crate) fn signal(pid: u32, signal: Signal) {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw);
    // It fails only if the process is gone, which is what is wanted.
    let _ = pid.map(|pid| kill_process(pid, signal));
}
