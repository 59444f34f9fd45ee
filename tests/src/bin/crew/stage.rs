//! The processes, and where they live.

use std::io;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use coloc_daemon::config::Config;
use coloc_shm_types::{RobotName, Space};
use rustix::process::{Pid, Signal, kill_process};

/// Robots.
pub(crate) const ROBOTS: usize = 5;
/// A daemon and a `coloc-rounds` each.
pub(crate) const PROGRAMS: usize = 2 * ROBOTS;
/// From slot to slot.
pub(crate) const SLOT_MS: u64 = 500;

pub(crate) const PREFIX: &str = "crew";
const PATIENCE: Duration = Duration::from_secs(60);

pub(crate) type Problem = Box<dyn std::error::Error>;

/// About where the robots are, and look: they drive to and fro, or turn.
const POSES: [[f64; 3]; ROBOTS] = [
    [0.0, 0.0, 0.1],
    [4.0, 0.5, 1.0],
    [3.0, 4.0, -2.0],
    [-1.0, 3.5, 2.5],
    [1.5, 1.5, 0.0],
];

/// How far they drive and turn \[m, rad\]: no farther than a daemon that begins anew is uncertain.
const WAY: [f64; 2] = [0.3, 0.1];
/// There and back again \[s\].
const THERE_AND_BACK_S: f64 = 4.0;

/// Where a robot is: every other one drives, the others turn.
#[allow(clippy::cast_precision_loss)] // Days in nanoseconds.
pub(crate) fn truth(robot: usize, boottime_ns: i64) -> [f64; 3] {
    let [x, y, phi] = POSES[robot];
    let phase = boottime_ns as f64 * 1e-9 / THERE_AND_BACK_S + 0.2 * robot as f64;
    let along = (std::f64::consts::TAU * phase).sin();
    if robot.is_multiple_of(2) {
        let (sin, cos) = phi.sin_cos();
        [x + WAY[0] * along * cos, y + WAY[0] * along * sin, phi]
    } else {
        [x, y, phi + WAY[1] * along]
    }
}

/// The stage.
pub(crate) struct Stage {
    home: tempfile::TempDir,
    space: Space,
    programs: Vec<Option<Child>>,
}

pub(crate) fn name(robot: usize) -> Result<RobotName, Problem> {
    Ok(RobotName::new(&format!("robot{}", robot + 1))?)
}

impl Stage {
    pub(crate) fn new() -> Result<Self, Problem> {
        let home = tempfile::tempdir()?;
        let space = Space::open(&home.path().join("shm"), PREFIX, "crew")?;
        let stage = Self {
            home,
            space,
            programs: (0..PROGRAMS).map(|_| None).collect(),
        };
        for robot in 0..ROBOTS {
            std::fs::write(stage.file(robot, "toml"), stage.configuration(robot))?;
        }
        Ok(stage)
    }

    fn configuration(&self, robot: usize) -> String {
        let member = |it| format!("[[team]]\nname = \"robot{0}\"\nid = {0}\n", it + 1);
        let team = (0..ROBOTS).map(member).collect::<Vec<_>>().concat();
        let [x, y, phi] = POSES[robot];
        let number = robot + 1;
        let root = self.home.path().join("shm");
        let record = self.file(robot, "jsonl");
        format!(
            "[robot]\nname = \"robot{number}\"\nid = {number}\n{team}[clock]\nsource = \"boottime\"\n\
             [shm]\nroot = \"{}\"\nprefix = \"{PREFIX}\"\n\
             [odometry]\nmax_speed_mps = 2.0\nmax_turn_rate_radps = 3.0\n[odometry.base]\n\
             [initial]\npose = [{x:?}, {y:?}, {phi:?}]\nsigma = [0.3, 0.3, 0.1]\n\
             [fusion]\nmode = \"rounds\"\n[rounds]\nrate_hz = 2.0\n\
             [realtime]\nscheduler = \"other\"\nlock_memory = false\n\
             [telemetry]\nrecord = \"{}\"\n",
            root.display(),
            record.display(),
        )
    }

    pub(crate) fn root(&self) -> PathBuf {
        self.home.path().join("shm")
    }

    pub(crate) fn space(&self) -> &Space {
        &self.space
    }

    pub(crate) fn file(&self, robot: usize, extension: &str) -> PathBuf {
        self.home
            .path()
            .join(format!("robot{}.{extension}", robot + 1))
    }

    pub(crate) fn config(&self, robot: usize) -> Result<Config, Problem> {
        Ok(Config::load(&self.file(robot, "toml"))?)
    }

    /// Of all lives of a robot.
    pub(crate) fn recordings(&self, robot: usize) -> impl Iterator<Item = PathBuf> {
        let first = self.file(robot, "jsonl");
        let later = (1..).map(move |life| {
            let mut name = first.clone().into_os_string();
            name.push(format!(".{life}"));
            PathBuf::from(name)
        });
        let all = std::iter::once(self.file(robot, "jsonl")).chain(later);
        all.take_while(|file| file.exists())
    }

    fn start(&mut self, program: usize) -> Result<(), Problem> {
        let what = if program < ROBOTS {
            "colocd"
        } else {
            "coloc-rounds"
        };
        let mut command = Command::new(std::env::current_exe()?);
        command.args([what, "run"]);
        command.arg(self.file(program % ROBOTS, "toml"));
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        self.programs[program] = Some(command.spawn()?);
        Ok(())
    }

    pub(crate) fn start_all(&mut self) -> Result<(), Problem> {
        (0..PROGRAMS).try_for_each(|program| self.start(program))
    }

    /// SIGKILL, and its next life.
    pub(crate) fn kill(&mut self, program: usize) -> Result<(), Problem> {
        if let Some(mut child) = self.programs[program].take() {
            if let Some(status) = child.try_wait()? {
                return Err(format!("program {program} ended by itself: {status}").into());
            }
            child.kill()?;
            child.wait()?;
        }
        self.start(program)
    }

    /// In good order, those that make rounds first.
    pub(crate) fn end_all(&mut self) -> Result<(), Problem> {
        for program in (0..PROGRAMS).rev() {
            let Some(mut child) = self.programs[program].take() else {
                continue;
            };
            let pid = Pid::from_raw(child.id().cast_signed()).ok_or("no process")?;
            kill_process(pid, Signal::TERM).map_err(io::Error::from)?;
            let status = child.wait()?;
            if !status.success() {
                return Err(format!("program {program}: {status}").into());
            }
        }
        Ok(())
    }
}

/// Waits until it holds, not forever.
pub(crate) fn until(what: &str, mut holds: impl FnMut() -> bool) -> Result<(), Problem> {
    let deadline = Instant::now() + PATIENCE;
    while !holds() {
        if Instant::now() > deadline {
            return Err(format!("in vain: {what}").into());
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Ok(())
}

impl Drop for Stage {
    fn drop(&mut self) {
        for child in self.programs.iter_mut().flatten() {
            // Both fail only if it is gone already.
            let _ = (child.kill(), child.wait());
        }
    }
}
