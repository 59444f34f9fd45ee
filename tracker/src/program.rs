//! The program `coloc-track`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::{Parser, Subcommand};
use coloc_daemon::config::Config;
use coloc_sensors::page::{self, Names};
use coloc_sensors::run;
use coloc_sensors::status::{Line, Reporter};
use coloc_sensors::stop::Woken;
use coloc_sensors::teller::Teller;
use coloc_sensors::{EndError, Moment, Stop, end};
use coloc_shm_types::{Health, Space, boot};

use crate::publish::Channels;
use crate::refusal::Refusal;
use crate::section::Track;
use crate::tracker::{FIGURES, Tracker};

const NAME: &str = "coloc-track";
const DRIVER: &str = "track";

/// Where the neighbours are, of what is seen of them in part.
#[derive(Debug, Parser)]
#[command(name = NAME, version, arg_required_else_help = true)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Track the neighbours, until SIGINT or SIGTERM.
    Run {
        /// The robot's configuration, with a section [track].
        config: PathBuf,
    },
    /// Read a configuration, say what it means and what is unlikely about it, open nothing.
    Check {
        /// The robot's configuration.
        config: PathBuf,
        /// End with status 1 if anything is unlikely.
        #[arg(long)]
        strict: bool,
    },
    /// Print the status of the coloc-track that runs with this configuration, once.
    Status {
        /// The robot's configuration.
        config: PathBuf,
    },
}

/// The whole program, from its arguments to its exit status.
pub fn main_from_args<I, T>(args: I) -> ExitCode
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    coloc_daemon::file_size::let_writers_see_the_limit();
    let result = match Args::try_parse_from(args) {
        Ok(Args { command }) => match command {
            Command::Run { config } => run(&config),
            Command::Check { config, strict } => check(&config, strict),
            Command::Status { config } => status(&config),
        },
        Err(answer) => {
            // If nobody reads it, nobody is left to tell.
            let _ = answer.print();
            return ExitCode::from(u8::from(answer.use_stderr()) * 2);
        }
    };
    end::finish(NAME, result)
}

fn run(path: &Path) -> Result<(), EndError> {
    let stop = Stop::on_signals().map_err(EndError::of("signals cannot be handled"))?;
    let (config, section) = Config::load_with::<Track>(path)?;
    let space = config.open_space(NAME)?;
    let mut life = Life {
        tracker: Tracker::new(&config, &section, boot()),
        channels: Channels::open(&space, &config)?,
        reporter: Reporter::open(&space, &config.robot.name, DRIVER, 0)?,
        teller: Teller::new(NAME),
        line: Line {
            is_open: true,
            opened: 1,
            bytes: 0,
        },
        health: None,
        told: Instant::now(),
        section,
    };
    let ended = life.run(&space, &stop);
    life.teller.finish();
    ended
}

struct Life {
    section: Track,
    tracker: Tracker,
    channels: Channels,
    reporter: Reporter,
    teller: Teller,
    line: Line,
    health: Option<Health>,
    /// When tracks were last published.
    told: Instant,
}

impl Life {
    /// `colocd` rings at every tick; without it there is still a look from time to time.
    fn run(&mut self, space: &Space, stop: &Stop) -> Result<(), EndError> {
        loop {
            let woken = stop
                .wait(Some(self.channels.bell()?), run::IDLE)
                .map_err(EndError::of("it cannot be waited"))?;
            if woken == Woken::Stop {
                return Ok(());
            }
            self.turn();
            self.report(space)?;
            self.teller.tell(Instant::now());
        }
    }

    fn turn(&mut self) {
        let now = Moment::now();
        self.line.bytes += self.channels.hear(&mut self.tracker, now);
        if let Some(moved) = self.tracker.moved() {
            self.channels.tell_moved(&moved, &mut self.tracker, now);
        }
        self.tracker.step(now);
        if self.told.elapsed().as_secs_f64() >= self.section.period_s {
            self.told = Instant::now();
            self.channels.tell_tracks(&mut self.tracker);
        }
    }

    fn report(&mut self, space: &Space) -> Result<(), EndError> {
        for remark in self.tracker.remarks() {
            self.teller.remark(remark);
        }
        if let Some(now) = self.reporter.report(self.line, &self.tracker.report()) {
            if self.health.replace(now) != Some(now) {
                self.teller.remark(format!("what is heard is {now}"));
            }
            space.check()?;
        }
        Ok(())
    }
}

fn check(path: &Path, strict: bool) -> Result<(), EndError> {
    let (config, section) = Config::load_with::<Track>(path)?;
    let warnings = unlikely(&config);
    page::check(understood(&config, &section), &warnings, strict)
}

/// A configuration in words, a line a subject.
fn understood(config: &Config, section: &Track) -> String {
    let [x, y, turned] = config.sighting.mount;
    let mut lines = vec![
        format!("robot        {}", config.robot.name),
        format!("mount        {x} m forward, {y} m left, turned {turned} rad to the left"),
        format!(
            "tracks       {} s behind the present, published every {} s",
            section.delay_s, section.period_s
        ),
        format!(
            "believed     after {} sightings; coasted after {} s, given up after {} s unseen or beyond σ = {} m",
            section.confirm_hits, section.coast_s, section.delete_s, section.most_sigma_m
        ),
    ];
    let peers = config.peers();
    lines.extend(peers.map(|peer| format!("robot {:<6} {}", peer.id, peer.name)));
    lines.join("\n") + "\n"
}

/// What is allowed in the file and was hardly meant.
#[must_use]
pub fn unlikely(config: &Config) -> Vec<String> {
    let is_alone = config.peers().next().is_none();
    let alone =
        is_alone.then(|| "[[team]] names no other robot: there is nobody to be tracked".to_owned());
    alone.into_iter().collect()
}

fn status(path: &Path) -> Result<(), EndError> {
    let (config, _) = Config::load_with::<Track>(path)?;
    let names = Names {
        program: NAME,
        driver: DRIVER,
        source: 0,
        refusals: &Refusal::ALL.map(Refusal::name),
        figures: &FIGURES,
    };
    page::status(&config.open_space(NAME)?, &config.robot.name, &names)
}
