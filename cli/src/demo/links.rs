//! `--fleet`: each robot in a space of its own, as on a computer of its own, and `coloc-link` between them.

use std::net::{IpAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde::Serialize;

use super::DemoError;
use super::fleet::{Fleet, Program, signal};
use super::robot_file::{TEAM, link_directory, name};
use crate::args::{DemoArgs, WrongClock};

/// The program.
pub(crate) const LINK: &str = "coloc-link";
/// Where a link listens that has a network of its own.
const PORT: u16 = 7373;
/// How long namespaces may take.
const PATIENCE: Duration = Duration::from_secs(10);
const LOOK: Duration = Duration::from_millis(10);

/// What is between the robots.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    program: PathBuf,
    /// Where each link listens, and where others call it, which is another place where the network is bad.
    addresses: Vec<[String; 2]>,
    /// Each robot is in a network namespace of its own.
    apart: bool,
    loss: f64,
    delay_ms: f64,
    /// From when to when nobody reaches anybody \[s\].
    partition: Option<[f64; 2]>,
    /// Whose clock is wrong, and how.
    wrong_clock: Option<WrongClock>,
    correct_offset: bool,
    seed: u64,
}

/// `[link]` of the demo's robots.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct LinkSection {
    listen: String,
    directory: PathBuf,
    insecure: bool,
    correct_offset: bool,
}

impl LinkSection {
    pub(crate) const NAME: &'static str = "link";
}

impl Plan {
    /// What was asked for, if links were.
    pub(crate) fn of(args: &DemoArgs, robots: usize) -> Result<Option<Self>, DemoError> {
        if !args.fleet {
            return Ok(None);
        }
        let (loss, delay_ms) = (args.loss, args.delay_ms);
        let bad = loss > 0.0 || delay_ms > 0.0 || args.partition.is_some();
        let listens = if args.namespaces {
            (0..robots)
                .map(|robot| format!("{}:{PORT}", own_addresses(robot)[0]))
                .collect()
        } else {
            free_addresses(2 * robots)?
        };
        let (listens, between) = listens.split_at(robots);
        let called = if between.is_empty() || !bad {
            listens
        } else {
            between
        };
        let addresses = listens.iter().zip(called);
        Ok(Some(Self {
            program: program()?,
            addresses: addresses
                .map(|(it, called)| [it.clone(), called.clone()])
                .collect(),
            apart: args.namespaces,
            loss,
            delay_ms,
            partition: args.partition,
            wrong_clock: args.wrong_clock.clone(),
            correct_offset: args.correct_offset,
            seed: args.seed,
        }))
    }

    /// The section of a robot whose own directory that is.
    pub(crate) fn section(&self, robot: usize, directory: &Path) -> LinkSection {
        let listen = self
            .addresses
            .get(robot)
            .map(|[listens, _]| listens.clone());
        LinkSection {
            listen: listen.unwrap_or_default(),
            directory: directory.into(),
            insecure: !self.apart,
            correct_offset: self.correct_offset,
        }
    }

    /// What its link is told of its clock.
    fn clock_of(&self, robot: usize) -> Vec<String> {
        let wrong = self.wrong_clock.as_ref();
        let own = wrong.filter(|it| usize::from(it.robot) == robot + 1);
        own.map(|it| format!("--wrong-clock={}", it.how))
            .into_iter()
            .collect()
    }

    fn is_bad(&self) -> bool {
        self.loss > 0.0 || self.delay_ms > 0.0 || self.partition.is_some()
    }

    /// In words.
    pub(crate) fn words(&self) -> String {
        let mut words =
            vec!["each robot in a space of its own, coloc-link between them".to_owned()];
        if self.apart {
            words.push("each in a network namespace of its own".into());
        }
        if self.is_bad() {
            words.push(format!(
                "over a network that loses {:.0} % and delays up to {:.0} ms each way",
                100.0 * self.loss,
                self.delay_ms
            ));
        }
        if let Some([from, until]) = self.partition {
            words.push(format!("cut from {from} s to {until} s"));
        }
        if let Some(WrongClock { robot, how }) = &self.wrong_clock {
            words.push(format!("the clock of robot{robot} wrong by {how}"));
        }
        words.join(", ")
    }
}

/// The links, and the network between them.
pub(crate) struct Links {
    plan: Plan,
    carriers: Fleet,
    weather: Option<Fleet>,
    networks: Vec<PathBuf>,
    cut: bool,
}

impl Links {
    /// Starts a link for each configuration, below `home`.
    pub(crate) fn start(
        plan: &Plan,
        files: &[PathBuf],
        home: &Path,
        logs: &Path,
    ) -> Result<Self, DemoError> {
        let team = home.join(TEAM);
        if plan.apart {
            found_team(plan, &team)?;
        } else {
            for robot in 0..files.len() {
                write_roster(plan, &link_directory(home, robot))?;
            }
        }
        let is_needed = plan.apart || plan.is_bad();
        let mut weather = is_needed.then(|| weather(plan, logs)).transpose()?;
        let networks = weather.as_mut().filter(|_| plan.apart).map(networks);
        let networks = networks.transpose()?.unwrap_or_default();
        let carriers = Fleet::start_each(Program::Link, files, &networks, logs, &|robot| {
            plan.clock_of(robot)
        })?;
        Ok(Self {
            plan: plan.clone(),
            carriers,
            weather,
            networks,
            cut: false,
        })
    }

    /// The namespace of each robot; none where they share this one.
    pub(crate) fn networks(&self) -> &[PathBuf] {
        &self.networks
    }

    /// Cuts and mends the network when it is time.
    pub(crate) fn follow(&mut self, time_s: f64) {
        let cut = self.plan.partition;
        let cut = cut.is_some_and(|[from, until]| (from..until).contains(&time_s));
        if cut != self.cut {
            self.cut = cut;
            let told = if cut { Signal::USR1 } else { Signal::USR2 };
            let weather = self.weather.as_mut().map(Fleet::look).unwrap_or_default();
            weather
                .into_iter()
                .flatten()
                .for_each(|pid| signal(pid, told));
        }
    }

    /// A link that has ended, and what it said last.
    pub(crate) fn ended(&mut self) -> Option<(usize, String)> {
        let ended = self.carriers.look().iter().position(Result::is_err)?;
        Some((ended, self.carriers.last_words(ended)))
    }

    /// Ends them. Says what each knew of each other at the end.
    pub(crate) fn stop(&mut self) -> Vec<String> {
        self.carriers.stop();
        if let Some(weather) = &mut self.weather {
            weather.stop();
        }
        let robots = 0..self.plan.addresses.len();
        robots.flat_map(|robot| self.words_of(robot)).collect()
    }

    fn words_of(&self, robot: usize) -> Vec<String> {
        let words = self.carriers.words(robot);
        let lines = words
            .lines()
            .filter_map(|line| line.strip_prefix("coloc-link: "));
        let mut last: Vec<_> = lines
            .filter(|line| line.contains(": round trip "))
            .collect();
        last.sort_unstable();
        last.dedup_by_key(|line| line.split(':').next().unwrap_or_default().to_owned());
        last.iter()
            .map(|line| format!("{} ◄─► {line}", name(robot + 1)))
            .collect()
    }
}

fn write_roster(plan: &Plan, directory: &Path) -> Result<(), DemoError> {
    std::fs::create_dir_all(directory).map_err(DemoError::spawn)?;
    let members = plan.addresses.iter().zip(1..);
    let members = members.map(|([_, called], id)| format!("{}={id}@{called}", name(id)));
    let mut made = Command::new(&plan.program);
    made.arg("rehearsal-roster")
        .arg(directory.join("fleet.toml"));
    done(made.args(members))
}

/// Makes the team as a person would, with keys that nobody else has.
fn found_team(plan: &Plan, team: &Path) -> Result<(), DemoError> {
    let fleet = |what: &str| {
        let mut command = Command::new(&plan.program);
        command.args(["fleet", what]).arg(team);
        command
    };
    done(&mut fleet("init"))?;
    for ([_, called], id) in plan.addresses.iter().zip(1..) {
        let number = id.to_string();
        done(fleet("add").args([&name(id), "--id", &number, "--address", called]))?;
    }
    Ok(())
}

fn done(command: &mut Command) -> Result<(), DemoError> {
    let spawn = |error: String| DemoError::Spawn(format!("{LINK}: {error}"));
    let made = command.output().map_err(|error| spawn(error.to_string()))?;
    if made.status.success() {
        return Ok(());
    }
    Err(spawn(String::from_utf8_lossy(&made.stderr).trim().into()))
}

fn weather(plan: &Plan, logs: &Path) -> Result<Fleet, DemoError> {
    let mut arguments: Vec<String> = vec![
        if plan.apart { "networks" } else { "weather" }.into(),
        format!("--loss={}", plan.loss),
        format!("--delay-ms={}", plan.delay_ms),
        format!("--seed={}", plan.seed),
    ];
    let ways = plan.addresses.iter().enumerate();
    arguments.extend(ways.map(|(robot, [listens, called])| {
        if plan.apart {
            own_addresses(robot).map(|it| it.to_string()).join(",")
        } else {
            format!("{called}={listens}")
        }
    }));
    Fleet::of_one(&plan.program, &arguments, &logs.join("weather.log"))
}

/// The namespaces that it has made, once it has.
fn networks(weather: &mut Fleet) -> Result<Vec<PathBuf>, DemoError> {
    let until = Instant::now() + PATIENCE;
    loop {
        let words = weather.words(0);
        if words.lines().any(|line| line == "ready") {
            let places = words.lines().filter_map(|it| it.strip_prefix("network "));
            return Ok(places.map(PathBuf::from).collect());
        }
        let ended = weather.look().iter().any(Result::is_err);
        if ended || Instant::now() > until {
            let why = weather.last_words(0);
            return Err(DemoError::Spawn(format!("--namespaces: {why}")));
        }
        std::thread::sleep(LOOK);
    }
}

/// A robot's addresses in its namespace, which no other network sees.
fn own_addresses(robot: usize) -> [IpAddr; 2] {
    let number = u8::try_from(robot + 1).unwrap_or(u8::MAX);
    let six = [0xfd73, 0, 0, 0, 0, 0, 0, number.into()];
    [[10, 73, 73, number].into(), six.into()]
}

/// Beside this program, where `cargo` puts it.
pub(crate) fn program() -> Result<PathBuf, DemoError> {
    let own = std::env::current_exe().map_err(DemoError::spawn)?;
    let link = own.with_file_name(LINK);
    if link.is_file() {
        return Ok(link);
    }
    Err(DemoError::Spawn(format!(
        "--fleet needs {}, which is not there: cargo build --release -p {LINK}",
        link.display()
    )))
}

/// Ports of loopback that nobody has at this moment.
fn free_addresses(count: usize) -> Result<Vec<String>, DemoError> {
    let sockets = (0..count).map(|_| UdpSocket::bind("127.0.0.1:0"));
    let sockets: Result<Vec<_>, _> = sockets.collect();
    let sockets = sockets.map_err(DemoError::spawn)?;
    let addresses = sockets
        .iter()
        .map(|it| it.local_addr().map(|it| it.to_string()));
    let addresses: Result<_, _> = addresses.collect();
    addresses.map_err(DemoError::spawn)
}
