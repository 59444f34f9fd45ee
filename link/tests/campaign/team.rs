//! Robots, each with a space, a link and perhaps a daemon.
use std::fs::{self, File};
use std::io::Write as _;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use coloc_link::roster::{self, Role};
use coloc_shm_types::{DriverStatus, Space};

use crate::process::Process;
use crate::support::{PATIENCE, PREFIX, free_address, member, name, roster};

pub(crate) struct Robot {
    pub(crate) id: u16,
    pub(crate) space: Space,
    pub(crate) directory: PathBuf,
    pub(crate) listens: SocketAddr,
    pub(crate) link: Option<Process>,
    pub(crate) daemon: Option<Process>,
    /// What its link is told beside its configuration.
    pub(crate) told: Vec<String>,
    file: PathBuf,
}

/// Members with these numbers, each where it listens.
pub(crate) fn members(robots: &[Robot]) -> Vec<roster::Member> {
    let members = robots.iter();
    let members = members.map(|it| member(it.id, Role::Robot, Some(it.listens)));
    members.collect()
}

/// As many robots with their links, all of which know one another; nothing runs yet.
pub(crate) fn team(home: &Path, robots: u16) -> Vec<Robot> {
    let ids: Vec<u16> = (1..=robots).collect();
    let robots: Vec<_> = ids.iter().map(|id| Robot::new(home, *id, &ids)).collect();
    let text = roster(1, members(&robots));
    for robot in &robots {
        robot.goes_by(&text);
    }
    robots
}

impl Robot {
    pub(crate) fn new(home: &Path, id: u16, team: &[u16]) -> Self {
        let directory = home.join(format!("robot{id}"));
        fs::create_dir_all(&directory).unwrap();
        let (root, listens) = (directory.join("shm"), free_address());
        let others = team.iter().filter(|other| **other != id);
        let others: Vec<_> = others
            .map(|other| format!("[[team]]\nname = \"robot{other}\"\nid = {other}\n"))
            .collect();
        let others = others.concat();
        let (shm, own) = (root.display(), directory.display());
        let text = format!(
            "[robot]\nname = \"robot{id}\"\nid = {id}\n{others}[shm]\nroot = \"{shm}\"\nprefix = \"{PREFIX}\"\n\
             [clock]\nsource = \"realtime\"\n[initial]\npose = [0.0, 0.0, 0.0]\n\
             [telemetry]\nstate_file = \"{own}/belief.toml\"\n\
             [link]\nlisten = \"{listens}\"\ndirectory = \"{own}\"\ninsecure = true\nmax_offset_s = 1.0\n"
        );
        let file = directory.join("robot.toml");
        fs::write(&file, text).unwrap();
        Self {
            id,
            space: Space::open(&root, PREFIX, "campaign").unwrap(),
            directory,
            listens,
            link: None,
            daemon: None,
            told: Vec::new(),
            file,
        }
    }

    /// Gives it a roster, as an operator does.
    pub(crate) fn goes_by(&self, roster: &str) {
        fs::write(self.directory.join("fleet.toml"), roster).unwrap();
    }

    /// One more line of its `[link]`.
    pub(crate) fn set(&self, line: &str) {
        let mut file = File::options().append(true).open(&self.file).unwrap();
        writeln!(file, "{line}").unwrap();
    }

    pub(crate) fn start_link(&mut self) {
        let mut log = File::options();
        let log = log.append(true).create(true).open(self.log()).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_coloc-link"));
        command.arg("run").arg(&self.file).args(&self.told);
        let quiet = command.stdin(Stdio::null()).stdout(Stdio::null());
        self.link = Some(Process::start(quiet.stderr(log)));
    }

    pub(crate) fn start_daemon(&mut self) {
        self.daemon = Some(self.program("colocd"));
    }

    /// Starts one of the programs that this one can be.
    pub(crate) fn program(&self, name: &str) -> Process {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args([name, "run"]).arg(&self.file);
        let quiet = command.stdin(Stdio::null()).stdout(Stdio::null());
        let log = File::create(self.directory.join(format!("{name}.log"))).unwrap();
        Process::start(quiet.stderr(log))
    }

    /// Changes its configuration, before anything of it runs.
    pub(crate) fn configure(&self, change: impl FnOnce(String) -> String) {
        let text = fs::read_to_string(&self.file).unwrap();
        fs::write(&self.file, change(text)).unwrap();
    }

    /// What `coloc-link check` says on it.
    pub(crate) fn check(&self) -> String {
        let mut command = Command::new(env!("CARGO_BIN_EXE_coloc-link"));
        let said = command.arg("check").arg(&self.file).output().unwrap();
        let [out, err] =
            [said.stdout, said.stderr].map(|it| String::from_utf8_lossy(&it).into_owned());
        out + &err
    }

    /// What its link knows at this moment, in the order of `coloc_link::post::FIGURES`.
    pub(crate) fn figures(&self) -> [f64; 8] {
        let statuses = self.space.subscriber::<DriverStatus>(&self.name());
        let heard = statuses.unwrap().wait(PATIENCE);
        heard.unwrap().unwrap().figures
    }

    fn log(&self) -> PathBuf {
        self.directory.join("link.log")
    }

    /// Ends its link; what it says last of signatures and messages.
    pub(crate) fn last_words(&mut self) -> String {
        self.link.take().unwrap().end();
        let log = fs::read_to_string(self.log()).unwrap();
        let line = log.lines().rfind(|line| line.contains("signed "));
        line.unwrap_or("coloc-link: nothing")
            .replace("coloc-link: ", "")
    }

    pub(crate) fn name(&self) -> coloc_shm_types::RobotName {
        name(self.id)
    }
}
