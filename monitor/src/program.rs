//! The program `coloc-bounds`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::{Parser, Subcommand};
use coloc_daemon::config::Config;
use coloc_sensors::page::{self, Names};
use coloc_sensors::status::{Line, Reporter};
use coloc_sensors::stop::Woken;
use coloc_sensors::teller::Teller;
use coloc_sensors::{EndError, Moment, Stop, end};
use coloc_shm_types::{Integrity as Word, Space};

use crate::publish::{Channels, FIGURES};
use crate::refusal::Refusal;
use crate::section::{Bounds, Integrity};
use crate::watch::{Said, Watch};

const NAME: &str = "coloc-bounds";
const DRIVER: &str = "bounds";

/// From one look at the channels and the buses to the next.
const LOOK: Duration = Duration::from_millis(20);

/// Where the robot must be if all errors are within their bounds, and whether its estimate can be right.
#[derive(Debug, Parser)]
#[command(name = NAME, version, arg_required_else_help = true)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Watch over the robot, until SIGINT or SIGTERM.
    Run {
        /// The robot's configuration, with a section [bounds].
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
    /// Print the status of the coloc-bounds that runs with this configuration, once.
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

/// Both sections; `[integrity]` need not be there.
fn load(path: &Path) -> Result<(Config, Bounds, Integrity), EndError> {
    let (config, bounds) = Config::load_with::<Bounds>(path)?;
    let integrity = if config.integrity.is_there {
        Config::load_with::<Integrity>(path)?.1
    } else {
        Integrity::default()
    };
    Ok((config, bounds, integrity))
}

fn run(path: &Path) -> Result<(), EndError> {
    let stop = Stop::on_signals().map_err(EndError::of("signals cannot be handled"))?;
    let (config, bounds, integrity) = load(path)?;
    let space = config.open_space(NAME)?;
    let others: Vec<u16> = config.peers().map(|it| it.id).collect();
    let mut life = Life {
        watch: Watch::new(config.robot.id, &others, &bounds, integrity),
        channels: Channels::open(&space, &config, &bounds)?,
        reporter: Reporter::open(&space, &config.robot.name, DRIVER, 0)?,
        teller: Teller::new(NAME),
        line: Line {
            is_open: true,
            opened: 1,
            bytes: 0,
        },
        state: None,
    };
    let ended = life.run(&space, &stop);
    life.teller.finish();
    ended
}

struct Life {
    watch: Watch,
    channels: Channels,
    reporter: Reporter,
    teller: Teller,
    line: Line,
    /// Of the last word.
    state: Option<u8>,
}

impl Life {
    fn run(&mut self, space: &Space, stop: &Stop) -> Result<(), EndError> {
        loop {
            let woken = stop
                .wait(None, LOOK)
                .map_err(EndError::of("it cannot be waited"))?;
            if woken == Woken::Stop {
                return Ok(());
            }
            self.turn();
            let report = self.channels.report(&self.watch);
            if self.reporter.report(self.line, &report).is_some() {
                space.check()?;
            }
            self.teller.tell(Instant::now());
        }
    }

    fn turn(&mut self) {
        let now = Moment::now();
        self.line.bytes += self.channels.hear(&mut self.watch, now);
        let said = self.watch.step(self.channels.common_ns(now));
        self.channels.tell_all(&said);
        for word in &said {
            if let Said::Integrity(word) = word {
                self.remark(word);
            }
        }
    }

    /// A change is said once.
    fn remark(&mut self, word: &Word) {
        if self.state.replace(word.state) != Some(word.state) {
            self.teller.remark(spoken(word));
        }
    }
}

/// What a word says, for the log.
fn spoken(word: &Word) -> String {
    let named = word.conflicts().iter().map(|it| {
        use coloc_shm_types::Suspect as S;
        let robot = it.robot;
        match it.kind {
            S::FIX => format!("the fixes of robot {robot}"),
            S::SIGHTINGS => format!("all that robot {robot} sees"),
            S::SIGHTING => format!("where robot {robot} sees robot {}", it.other),
            S::COMPASS => format!("the compass of robot {robot}"),
            _ => format!("how robot {robot} moved"),
        }
    });
    let named: Vec<_> = named.collect();
    match word.state {
        Word::OK => "the estimate can be right".into(),
        Word::ESTIMATE_OUTSIDE => format!(
            "the estimate cannot be right: it is {:.2} m outside of where the robot must be",
            word.distance_m
        ),
        Word::BOUNDS_VIOLATED if named.is_empty() => {
            "what was measured cannot all be within its bounds: more than one thing is wrong".into()
        }
        Word::BOUNDS_VIOLATED => format!(
            "what was measured cannot all be within its bounds: without {} it could",
            named.join(", or without ")
        ),
        Word::NOT_OBSERVABLE => "nothing bounds where the robot is".into(),
        Word::STALE => "slots were not closed in time; it begins anew".into(),
        _ => "it begins".into(),
    }
}

fn check(path: &Path, strict: bool) -> Result<(), EndError> {
    let (config, bounds, integrity) = load(path)?;
    let warnings = unlikely(&config, &bounds);
    page::check(understood(&config, &bounds, integrity), &warnings, strict)
}

/// A configuration in words, a line a subject.
fn understood(config: &Config, bounds: &Bounds, integrity: Integrity) -> String {
    let from_sigmas = |given: f64, unit: &str| {
        if given > 0.0 {
            format!("{given} {unit}")
        } else {
            format!("{} standard deviations", bounds.sigmas)
        }
    };
    let compass = if bounds.compass_rad > 0.0 {
        format!("within {} rad", bounds.compass_rad)
    } else {
        "none that can be relied on".into()
    };
    let means = if bounds.mean_share < 1.0 {
        format!(
            "of {} slots within {} of these bounds",
            bounds.mean_slots, bounds.mean_share
        )
    } else {
        "nothing is promised".into()
    };
    let mut lines = vec![
        format!("robot        {}", config.robot.name),
        format!(
            "slots        of {} s, closed {} s after their end",
            bounds.slot_s, bounds.grace_s
        ),
        format!(
            "sightings    within {}, {}",
            from_sigmas(bounds.sighting_m, "m"),
            from_sigmas(bounds.sighting_rad, "rad")
        ),
        format!("fixes        within {}", from_sigmas(bounds.fix_m, "m")),
        format!(
            "wheels       within {} m/s forward, {} m/s to the side, {} rad/s",
            bounds.speed_mps, bounds.sideways_mps, bounds.turn_radps
        ),
        format!("compass      {compass}"),
        format!("means        {means}"),
        format!(
            "alarm        after {} slots outside, over after {} inside",
            integrity.alarm_slots, integrity.clear_slots
        ),
    ];
    let peers = config.peers();
    lines.extend(peers.map(|peer| format!("robot {:<6} {}", peer.id, peer.name)));
    lines.join("\n") + "\n"
}

/// What is allowed in the file and was hardly meant.
#[must_use]
pub fn unlikely(config: &Config, bounds: &Bounds) -> Vec<String> {
    let mut warnings = Vec::new();
    if config.odometry.is_none() {
        warnings.push(
            "there is no [odometry]: the robot may have driven at bounds.max_speed_mps all the time"
                .to_owned(),
        );
    }
    let limit = config.odometry.as_ref().map(|it| it.max_speed_mps);
    if let Some(limit) = limit.filter(|it| *it > bounds.max_speed_mps) {
        warnings.push(format!(
            "bounds.max_speed_mps = {}: odometry.max_speed_mps allows {limit}, so this robot may break it",
            bounds.max_speed_mps
        ));
    }
    if bounds.compass_rad == 0.0 {
        warnings.push(
            "bounds.compass_rad = 0: without a compass the regions of robots that have no fixes are many times as large"
                .to_owned(),
        );
    }
    if bounds.sigmas < 3.0 {
        warnings.push(format!(
            "bounds.sigmas = {}: Gaussian noise breaks that many times a minute",
            bounds.sigmas
        ));
    }
    warnings
}

fn status(path: &Path) -> Result<(), EndError> {
    let (config, ..) = load(path)?;
    let names = Names {
        program: NAME,
        driver: DRIVER,
        source: 0,
        refusals: &Refusal::ALL.map(Refusal::name),
        figures: &FIGURES,
    };
    page::status(&config.open_space(NAME)?, &config.robot.name, &names)
}
