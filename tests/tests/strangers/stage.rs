//! A directory like /tmp, and who acts in it.
use std::fs::{self, File, Permissions};
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use coloc_daemon::config::{Config, Realtime, Robot, Scheduler, Shm};
use coloc_drivers::can::BusSpec;
use coloc_drivers::encoder::OdometryConfig;
use coloc_shm_types::{Estimate, RobotName, Space};
use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};
use tempfile::TempDir;

pub(crate) const ACT: &str = "COLOC_STRANGER_ACT";
pub(crate) const PLACES: &str = "COLOC_STRANGER_PLACES";
pub(crate) const READY: &str = "ready";

const STRANGER: u32 = 65534;
const PREFIX: &str = "strangers";
pub(crate) const PATIENCE: Duration = Duration::from_secs(30);

pub(crate) fn chmod(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
}

/// Everybody may put something there, and only who did may take it away.
pub(crate) struct Stage {
    sticky: TempDir,
    /// This binary, where everybody may run it.
    program: PathBuf,
}

impl Stage {
    pub(crate) fn new() -> Option<Self> {
        if !rustix::process::geteuid().is_root() {
            eprintln!(
                "SKIPPED: what another user of the machine can do, which only the superuser can try"
            );
            return None;
        }
        let sticky = tempfile::tempdir().unwrap();
        chmod(sticky.path(), 0o1777);
        let program = sticky.path().join("strangers");
        fs::copy(std::env::current_exe().unwrap(), &program).unwrap();
        chmod(&program, 0o755);
        Some(Self { sticky, program })
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.sticky.path().join(name)
    }

    /// A directory that everybody may enter, for a robot. Its root and bus have `mode`, or are not there if that is 0.
    pub(crate) fn site(&self, mode: u32) -> PathBuf {
        let site = tempfile::tempdir_in(self.sticky.path()).unwrap().keep();
        chmod(&site, 0o755);
        for directory in ["shm", "bus"].iter().filter(|_| mode != 0) {
            fs::create_dir(site.join(directory)).unwrap();
            chmod(&site.join(directory), mode);
        }
        site
    }

    /// A directory of ours in which everybody may put something.
    pub(crate) fn open_directory(&self, mode: u32) -> PathBuf {
        let directory = tempfile::tempdir_in(self.sticky.path()).unwrap().keep();
        chmod(&directory, mode);
        directory
    }

    fn command_of(&self, user: User, act: &str, places: &[&Path]) -> Command {
        let places: Vec<_> = places.iter().map(|place| place.to_str().unwrap()).collect();
        let mut command = user.command(&self.program);
        command
            .args(["--ignored", "--exact", "the_stranger", "--nocapture"])
            .env(ACT, act)
            .env(PLACES, places.join("\n"));
        command
    }

    /// A directory of the stranger's.
    pub(crate) fn home(&self) -> PathBuf {
        let home = self.open_directory(0o700);
        std::os::unix::fs::chown(&home, Some(STRANGER), Some(STRANGER)).unwrap();
        home
    }

    /// A daemon that the stranger runs in his `home` under this umask.
    pub(crate) fn strangers_daemon(&self, home: &Path, umask: &str) -> Daemon {
        self.daemon_of(STRANGER_ALONE, home, umask, &configuration(home))
    }

    /// The same of another user and configuration.
    pub(crate) fn daemon_of(
        &self,
        user: User,
        home: &Path,
        umask: &str,
        configuration: &Config,
    ) -> Daemon {
        let program = self.path("colocd");
        if !program.exists() {
            fs::copy(env!("CARGO_BIN_EXE_colocd-under-test"), &program).unwrap();
            chmod(&program, 0o755);
        }
        let mut shell = user.command(Path::new("sh"));
        shell
            .args(["-c", "umask $1; exec \"$2\" run \"$3\"", "sh", umask])
            .arg(program);
        Daemon::spawn(shell, home, configuration)
    }

    /// What the stranger managed to do.
    pub(crate) fn stranger(&self, act: &str, places: &[&Path]) -> String {
        self.user(STRANGER_ALONE, act, places)
    }

    /// What that user managed to do.
    pub(crate) fn user(&self, user: User, act: &str, places: &[&Path]) -> String {
        let output = self.command_of(user, act, places).output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            output.status.success() && said.contains("1 passed"),
            "{output:?}"
        );
        let done = said.lines().filter_map(|line| line.split_once("did: "));
        done.map(|(_, what)| what).collect::<Vec<_>>().join("\n")
    }

    /// A stranger who holds on to something until it is dropped.
    pub(crate) fn stranger_stays(&self, act: &str, places: &[&Path]) -> Staying {
        self.user_stays(STRANGER_ALONE, act, places)
    }

    /// The same of that user.
    pub(crate) fn user_stays(&self, user: User, act: &str, places: &[&Path]) -> Staying {
        let mut command = self.command_of(user, act, places);
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        assert!(
            lines.any(|line| line.unwrap().ends_with(READY)),
            "it ended early"
        );
        Staying(child)
    }
}

/// By numbers, without other groups; nobody need know them.
#[derive(Copy, Clone, Debug)]
pub(crate) struct User {
    pub(crate) id: u32,
    pub(crate) group: u32,
}

const STRANGER_ALONE: User = User {
    id: STRANGER,
    group: STRANGER,
};

impl User {
    fn command(self, program: &Path) -> Command {
        let mut command = Command::new(program);
        command.current_dir("/").uid(self.id).gid(self.group);
        command
    }
}

pub(crate) struct Staying(Child);

impl Staying {
    pub(crate) fn id(&self) -> u32 {
        self.0.id()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        send(&self.0, signal);
    }
}

impl Staying {
    /// Lets go of it.
    pub(crate) fn ends_well(&mut self) {
        drop(self.0.stdin.take());
        assert!(self.0.wait().unwrap().success());
    }
}

impl Drop for Staying {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = (self.0.kill(), self.0.wait());
    }
}

/// Of a robot at `site`.
pub(crate) fn configuration(site: &Path) -> Config {
    let bus = BusSpec::Local {
        directory: site.join("bus"),
    };
    Config {
        shm: Shm {
            root: site.join("shm"),
            prefix: PREFIX.into(),
            ..Shm::default()
        },
        odometry: Some(OdometryConfig::differential(bus, 0.3, 1e-5, 5.0)),
        realtime: Realtime {
            scheduler: Scheduler::Other,
            lock_memory: false,
            ..Realtime::default()
        },
        ..Config::of(Robot {
            name: RobotName::new("robot1").unwrap(),
            id: 1,
        })
    }
}

fn send(child: &Child, signal: Signal) {
    kill_process(pid(child), signal).unwrap();
}

fn pid(child: &Child) -> Pid {
    Pid::from_raw(i32::try_from(child.id()).unwrap()).unwrap()
}

/// A robot's daemon, ours.
pub(crate) struct Daemon {
    child: Child,
    root: PathBuf,
    said: PathBuf,
}

impl Daemon {
    pub(crate) fn start(site: &Path, umask: &str) -> Self {
        Self::start_with(site, umask, &configuration(site))
    }

    pub(crate) fn start_with(site: &Path, umask: &str, configuration: &Config) -> Self {
        let mut shell = Command::new("sh");
        shell
            .args(["-c", "umask $1; exec \"$2\" run \"$3\"", "sh", umask])
            .arg(env!("CARGO_BIN_EXE_colocd-under-test"));
        Self::spawn(shell, site, configuration)
    }

    fn spawn(mut command: Command, site: &Path, configuration: &Config) -> Self {
        let (config, said) = (site.join("robot.toml"), site.join("said"));
        fs::write(&config, toml::to_string(configuration).unwrap()).unwrap();
        let child = command
            .arg(&config)
            .stderr(File::create(&said).unwrap())
            .spawn()
            .unwrap();
        Self {
            child,
            said,
            root: site.join("shm"),
        }
    }

    /// What it has written to standard error.
    pub(crate) fn said(&self) -> String {
        fs::read_to_string(&self.said).unwrap()
    }

    /// An estimate of a tick that was not there before.
    pub(crate) fn listen(&self) -> Estimate {
        let space = Space::open(&self.root, PREFIX, "test").unwrap();
        let robot = RobotName::new("robot1").unwrap();
        let estimates = space.subscriber::<Estimate>(&robot).unwrap();
        let deadline = Instant::now() + PATIENCE;
        let mut heard = Vec::new();
        while heard.len() < 2 {
            assert!(Instant::now() < deadline, "no estimates: {}", self.said());
            heard.extend(estimates.receive().unwrap());
            std::thread::sleep(Duration::from_millis(1));
        }
        heard[1]
    }

    /// SIGHUP.
    pub(crate) fn hang_up(&self) {
        self.signal(Signal::HUP);
    }

    /// Until it says so.
    pub(crate) fn wait_until_it_says(&self, what: &str) {
        let deadline = Instant::now() + PATIENCE;
        while !self.said().contains(what) {
            assert!(Instant::now() < deadline, "no `{what}`: {}", self.said());
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn signal(&self, signal: Signal) {
        send(&self.child, signal);
    }

    /// Scheduling class and priority in real time of the thread with this name.
    pub(crate) fn schedule_of(&self, thread: &str) -> (u32, u32) {
        let tasks = fs::read_dir(format!("/proc/{}/task", self.child.id())).unwrap();
        let mut tasks = tasks.map(|task| task.unwrap().path());
        let is_it =
            |task: &PathBuf| fs::read_to_string(task.join("comm")).unwrap().trim() == thread;
        let task = tasks.find(is_it).unwrap();
        let line = fs::read_to_string(task.join("stat")).unwrap();
        // Behind the name in parentheses is the third: proc_pid_stat(5).
        let (_, values) = line.rsplit_once(") ").unwrap();
        let value = |number: usize| values.split(' ').nth(number - 3).unwrap().parse().unwrap();
        (value(41), value(40))
    }

    /// Once this returns all of its threads stand still.
    pub(crate) fn stop(&self) {
        self.signal(Signal::STOP);
        let stopped = waitpid(Some(pid(&self.child)), WaitOptions::UNTRACED);
        assert!(stopped.unwrap().unwrap().1.stopped());
    }

    pub(crate) fn go_on(&self) {
        self.signal(Signal::CONT);
    }

    /// What it has said, if it ends by itself.
    pub(crate) fn refuses(mut self) -> String {
        assert_eq!(self.child.wait().unwrap().code(), Some(1));
        self.said()
    }

    /// What it has said by its end.
    pub(crate) fn terminate(mut self) -> String {
        self.signal(Signal::TERM);
        assert!(self.child.wait().unwrap().success());
        self.said()
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        // It has ended already, unless a test has failed.
        let _ = (self.child.kill(), self.child.wait());
    }
}
