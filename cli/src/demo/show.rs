//! Everything that runs during the demo, from its first process to its last.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rustix::process::Signal;

use super::DemoError;
use super::bus::Buses;
use super::bystanders::{Bystanders, Stall};
use super::children::ChildrenTime;
use super::clock::now_ns;
use super::console::Console;
use super::feed_thread::FeedThread;
use super::fleet::{ENTER, Fleet, Program, enter, signal};
use super::interrupt::Interrupt;
use super::lead::Lead;
use super::links::{Links, Plan};
use super::process::running;
use super::record::Record;
use super::robot_file::{name, write_all};
use super::scene::Eyes;
use super::table::{Progress, Shown, State, line, lines};
use super::watch::Watch;
use super::world::Stage;
use crate::home::{Home, is_inhabited};

/// How often estimates are taken in: well before their queue of 16 ticks is full.
const LISTEN_INTERVAL: Duration = Duration::from_millis(10);
const REDRAW_INTERVAL: Duration = Duration::from_millis(250);
const LINE_INTERVAL: Duration = Duration::from_secs(2);
/// How long the daemons may take to speak, and each one more: they share the processors.
const START_PATIENCE: Duration = Duration::from_secs(15);
const PATIENCE_PER_ROBOT: Duration = Duration::from_secs(2);
/// How long one that somebody started by hand may take to end.
const END_PATIENCE: Duration = Duration::from_secs(3);

/// The daemons, what they are fed and what is heard of them.
pub(crate) struct Show {
    seconds: f64,
    bystanders: Bystanders,
    robots_time: ChildrenTime,
    feed: FeedThread,
    fleet: Fleet,
    /// Each robot's coloc-laser, where robots have scanners.
    lasers: Option<Fleet>,
    /// What carries between the robots, where each is in a space of its own.
    links: Option<Links>,
    watch: Watch,
    /// The robots' configurations.
    files: Vec<PathBuf>,
    /// What a person types to start each daemon, up to its configuration.
    commands: Vec<String>,
    shown: Shown,
    roots: Vec<PathBuf>,
    lead: Option<Lead>,
}

/// What remains of it.
pub(crate) struct Ended {
    /// How long the robots drove \[s\].
    pub(crate) seconds: f64,
    /// The robots' configurations.
    pub(crate) files: Vec<PathBuf>,
    /// In the order of the robots.
    pub(crate) records: Vec<Record>,
    /// Whose daemon spoke until the end.
    pub(crate) up: Vec<bool>,
    /// When the machine stood still, if that was not because of the robots.
    pub(crate) stalls: Vec<Stall>,
    /// Files in shared memory that should not be there.
    pub(crate) left: Vec<PathBuf>,
    /// What went wrong at the end.
    pub(crate) trouble: Option<DemoError>,
    /// What the links say of one another.
    pub(crate) links: Vec<String>,
}

impl Show {
    /// Opens the ports and buses, then starts the daemons: they find everything in place. Call it on the main thread, with
    /// which the daemons end.
    pub(crate) fn set_up(
        stage: &Arc<Stage>,
        seconds: f64,
        home: &Home,
        buses: &Buses,
        logs: &Path,
        plan: Option<&Plan>,
    ) -> Result<Self, DemoError> {
        let roots = match plan {
            Some(_) => home.shm_roots(stage.robots()),
            None => vec![home.shm_root(); stage.robots()],
        };
        let files = write_all(home.path(), &roots, stage, &buses.specs, plan)?;
        let watch = Watch::open(Arc::clone(stage), &roots, seconds)?;
        let feed = FeedThread::start(stage, &roots, &buses.specs)?;
        let links = plan.map(|plan| Links::start(plan, &files, home.path(), logs));
        let links = links.transpose()?;
        let networks = links.as_ref().map(Links::networks).unwrap_or_default();
        let fleet = Fleet::start(Program::Daemon, &files, networks, logs)?;
        let has_scanners = matches!(stage.eyes(), Eyes::Scans(_));
        let lasers = has_scanners.then(|| Fleet::start(Program::Laser, &files, networks, logs));
        let own = PathBuf::from(format!("/proc/{}/ns/net", std::process::id()));
        let own = buses.private.then_some(&own);
        let commands = (0..stage.robots()).map(|robot| run_command(networks.get(robot).or(own)));
        let commands = commands.collect();
        let bystanders = Bystanders::start();
        Ok(Self {
            seconds,
            bystanders,
            robots_time: ChildrenTime::start(),
            feed,
            fleet,
            lasers: lasers.transpose()?,
            links,
            watch,
            files,
            commands,
            shown: stage.shown(),
            roots,
            lead: stage.lead().cloned(),
        })
    }

    /// Waits until every daemon has published a pose.
    pub(crate) fn wait_for_everybody(
        &mut self,
        console: &mut Console,
        interrupt: &Interrupt,
    ) -> Result<(), DemoError> {
        let started = Instant::now();
        let robots = u32::try_from(self.files.len()).unwrap_or(u32::MAX);
        let patience = START_PATIENCE + PATIENCE_PER_ROBOT.saturating_mul(robots);
        let mut said = false;
        while !self.watch.all_heard() && !interrupt.is_there() {
            self.watch.listen(None)?;
            self.complain_of_absentees(started.elapsed() > patience)?;
            if !said && started.elapsed() > LINE_INTERVAL {
                console.say("waiting for the daemons to come up");
                said = true;
            }
            std::thread::sleep(LISTEN_INTERVAL);
        }
        Ok(())
    }

    fn complain_of_absentees(&mut self, too_long: bool) -> Result<(), DemoError> {
        self.complain_of_lasers()?;
        let ended = self.fleet.look().iter().position(Result::is_err);
        let silent = self
            .watch
            .records()
            .iter()
            .position(|record| record.latest.is_none());
        let Some(robot) = ended.or(silent.filter(|_| too_long)) else {
            return Ok(());
        };
        Err(DemoError::NotUp {
            robot: name(robot + 1),
            last_words: self.fleet.last_words(robot),
        })
    }

    /// None of them ends by itself.
    fn complain_of_lasers(&mut self) -> Result<(), DemoError> {
        if let Some((robot, last_words)) = self.links.as_mut().and_then(Links::ended) {
            return Err(DemoError::Link {
                robot: name(robot + 1),
                last_words,
            });
        }
        let Some(lasers) = &mut self.lasers else {
            return Ok(());
        };
        let ended = lasers.look().iter().position(Result::is_err);
        ended.map_or(Ok(()), |robot| {
            Err(DemoError::Laser {
                robot: name(robot + 1),
                last_words: lasers.last_words(robot),
            })
        })
    }

    /// Lets the robots drive, and shows it, until the time is over or a person has seen enough.
    pub(crate) fn drive(
        &mut self,
        console: &mut Console,
        interrupt: &Interrupt,
    ) -> Result<(), DemoError> {
        self.feed.go();
        let interval = if console.is_terminal() {
            REDRAW_INTERVAL
        } else {
            LINE_INTERVAL
        };
        let mut shown = Instant::now();
        while !interrupt.is_there() && self.advance()?.is_continue() {
            if shown.elapsed() >= interval {
                self.show(console);
                shown = Instant::now();
            }
            std::thread::sleep(LISTEN_INTERVAL);
        }
        self.show(console);
        Ok(())
    }

    fn advance(&mut self) -> Result<ControlFlow<()>, DemoError> {
        self.watch.listen(self.feed.start_ns())?;
        self.complain_of_lasers()?;
        if self.feed.has_ended() {
            self.feed.stop()?;
            return Err(DemoError::Feed);
        }
        let progress = self.progress();
        self.befall(progress.time_s)?;
        if let Some(links) = &mut self.links {
            links.follow(progress.time_s);
        }
        Ok(if progress.time_s < self.seconds {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        })
    }

    /// What happens to the first leader.
    fn befall(&mut self, time_s: f64) -> Result<(), DemoError> {
        const FIRST: usize = 0;
        let Some(lead) = &self.lead else {
            return Ok(());
        };
        if lead.gone_s.contains(&time_s) {
            self.fleet.kill(FIRST);
        } else if time_s >= lead.gone_s.end {
            self.fleet.start_again(FIRST)?;
            self.lead = None; // Once.
        }
        Ok(())
    }

    fn show(&mut self, console: &mut Console) {
        let (progress, states) = (self.progress(), self.states());
        if console.is_terminal() {
            let rows = console.rows();
            console.redraw(&lines(
                progress,
                self.watch.records(),
                &states,
                self.shown,
                rows,
            ));
        } else {
            console.say(&line(progress, self.watch.records(), &states));
        }
    }

    fn progress(&self) -> Progress {
        Progress::at(now_ns(), self.feed.start_ns(), self.seconds)
    }

    /// A daemon that was started again by hand is not a child of ours, but acts for its robot all the same.
    fn states(&mut self) -> Vec<State> {
        let children = self.fleet.look();
        let started = self.commands.iter().zip(&self.files);
        let robots = self.watch.records().iter().zip(children).zip(started);
        let state = |((record, child), (command, file)): (
            (&Record, Result<u32, _>),
            (&String, &PathBuf),
        )| {
            let restart = format!("{command} {}", file.display());
            State::of(record, child.ok().or_else(|| running(file)), &restart)
        };
        robots.map(state).collect()
    }

    /// Ends everybody, the sensors first, and looks at what is left. Whatever goes wrong, what was heard is not lost.
    pub(crate) fn end(mut self, console: &mut Console) -> Ended {
        let (seconds, states) = (self.progress().time_s, self.states());
        let start_ns = self.feed.start_ns();
        let stopped = self.feed.stop();
        let lasers = self.lasers.as_mut().map(Fleet::stop).unwrap_or_default();
        for robot in lasers {
            console.say(&format!(
                "coloc-laser of {} did not end when asked and was killed",
                name(robot + 1)
            ));
        }
        let links = self.links.as_mut().map(Links::stop).unwrap_or_default();
        for robot in self.fleet.stop() {
            console.say(&format!(
                "{} did not end when asked and was killed",
                name(robot + 1)
            ));
        }
        self.end_strangers();
        let stalls = self.stalls(console);
        let heard = self.watch.listen(start_ns);
        let prefixes = self.watch.full_prefixes();
        let records = self.watch.close();
        let up = states
            .iter()
            .map(|state| matches!(state, State::Up(_)))
            .collect();
        Ended {
            seconds,
            files: self.files,
            records,
            up,
            stalls,
            links,
            left: left_in_all(&self.roots, prefixes),
            trouble: stopped.and(heard).err(),
        }
    }

    /// When the machine stood still. Robots that keep a processor busy half of the time have no excuse.
    fn stalls(&mut self, console: &mut Console) -> Vec<Stall> {
        let stalls = self.bystanders.end();
        let (busy_s, time_s) = (self.robots_time.passed_s(), self.progress().time_s);
        if stalls.is_empty() || busy_s < 0.5 * time_s {
            return stalls;
        }
        console.say(&format!(
            "this machine stood still now and then, and the robots took {busy_s:.1} s of a processor in {time_s:.1} s: no excuse for them"
        ));
        Vec::new()
    }

    /// Daemons that somebody started by hand would go on without sensors, in a folder that is about to go.
    fn end_strangers(&self) {
        let strangers = || self.files.iter().filter_map(|file| running(file));
        strangers().for_each(|pid| signal(pid, Signal::TERM));
        let deadline = Instant::now() + END_PATIENCE;
        while strangers().next().is_some() && Instant::now() < deadline {
            std::thread::sleep(LISTEN_INTERVAL);
        }
        strangers().for_each(|pid| signal(pid, Signal::KILL));
    }
}

fn run_command(network: Option<&PathBuf>) -> String {
    let program = std::env::current_exe().unwrap_or_else(|_| "coloc".into());
    let enter = network.map(|network| format!("{ENTER} {} ", enter(network)));
    let enter = enter.unwrap_or_default();
    format!("{enter}{} colocd run", program.display())
}

/// Of each space once.
fn left_in_all(roots: &[PathBuf], mut prefixes: Vec<String>) -> Vec<PathBuf> {
    prefixes.dedup();
    let spaces = roots.iter().zip(&prefixes);
    spaces
        .flat_map(|(root, prefix)| left_for_good(root, prefix))
        .collect()
}

/// Files of the space that are still there although everybody has left it. Somebody who listens from elsewhere takes a moment
/// to leave, and takes out then what is there.
fn left_for_good(root: &Path, prefix: &str) -> Vec<PathBuf> {
    let deadline = Instant::now() + END_PATIENCE;
    loop {
        let left = left_behind(root, prefix);
        if left.is_empty() || !is_inhabited(root) {
            return left_behind(root, prefix);
        }
        if Instant::now() > deadline {
            return Vec::new();
        }
        std::thread::sleep(LISTEN_INTERVAL);
    }
}

fn left_behind(root: &Path, prefix: &str) -> Vec<PathBuf> {
    let entries = |folder: &Path| {
        std::fs::read_dir(folder)
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path())
    };
    let ours = |path: &PathBuf| {
        path.file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with(prefix))
    };
    entries(Path::new("/dev/shm"))
        .filter(ours)
        .chain(entries(root))
        .collect()
}
