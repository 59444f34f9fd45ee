//! The program `coloc-rounds`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::{Parser, Subcommand};
use coloc_daemon::config::Config;
use coloc_estimator::Span;
use coloc_estimator::gate::{CHI2_1_99, CHI2_2_99};
use coloc_rounds::{Rules, Standing};
use coloc_sensors::page::{self, Names};
use coloc_sensors::status::{Line, Reporter};
use coloc_sensors::stop::Woken;
use coloc_sensors::teller::Teller;
use coloc_sensors::{EndError, Moment, Stop, end};
use coloc_shm_types::Space;

use crate::channels::{Channels, FIGURES, team};
use crate::refusal::Refusal;
use crate::seat::{Deed, Seat};

const NAME: &str = "coloc-rounds";
const DRIVER: &str = "rounds";

/// From one look at the channels to the next.
const LOOK: Duration = Duration::from_millis(5);

/// Of the deadline the robots that are there are waited for in so much; then everybody shares.
const HELLO: f64 = 0.4;

/// A robot whose last round nobody knows any more joins anew after so many slots.
const PATIENCE: u32 = 4;

/// One joint filter of the team, in rounds. While it runs the robot takes part.
#[derive(Debug, Parser)]
#[command(name = NAME, version, arg_required_else_help = true)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make rounds with the others, until SIGINT or SIGTERM.
    Run {
        /// The robot's configuration, with `fusion.mode = "rounds"`.
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
    /// Print the status of the coloc-rounds that runs with this configuration, once.
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

/// The seat of the robot of a configuration.
#[must_use]
pub fn seat(config: &Config) -> Option<Seat> {
    let team = team(config);
    let rounds = &config.rounds;
    let nanos = |seconds| Span::from_seconds(seconds).as_nanos();
    let rules = Rules {
        robots: team.numbers().len(),
        hello_ns: nanos(rounds.deadline_s * HELLO),
        deadline_ns: nanos(rounds.deadline_s),
        patience: PATIENCE,
        gates: [CHI2_1_99, CHI2_2_99, config.fusion.neighbour_gate],
    };
    let me = team.place(config.robot.id)?;
    Some(Seat::new(me, rules, nanos(rounds.skew_s)))
}

fn run(path: &Path) -> Result<(), EndError> {
    let stop = Stop::on_signals().map_err(EndError::of("signals cannot be handled"))?;
    let config = Config::load(path)?;
    let space = config.open_space(NAME)?;
    let Some(seat) = seat(&config) else {
        return Ok(()); // A robot is always of its own team.
    };
    let mut life = Life {
        seat,
        channels: Channels::open(&space, &config)?,
        reporter: Reporter::open(&space, &config.robot.name, DRIVER, 0)?,
        teller: Teller::new(NAME),
        line: Line {
            is_open: true,
            opened: 1,
            bytes: 0,
        },
        was_with: None,
    };
    if !config.makes_rounds() {
        life.teller
            .remark("fusion.mode is not \"rounds\": colocd takes no part");
    }
    let ended = life.run(&space, &stop);
    life.channels.correct(&Deed::Leave, Moment::now());
    life.teller.finish();
    ended
}

struct Life {
    seat: Seat,
    channels: Channels,
    reporter: Reporter,
    teller: Teller,
    line: Line,
    /// Whether the robot's last round was one of the team, as it was last said.
    was_with: Option<bool>,
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
            let now = Moment::now();
            let (words, bytes) = self.channels.hear(&mut self.seat, now);
            self.line.bytes += bytes;
            self.channels.say(&words, now);
            self.remark();
            let report = self.channels.report(&self.seat);
            if self.reporter.report(self.line, &report).is_some() {
                space.check()?;
            }
            self.teller.tell(Instant::now());
        }
    }

    /// A change is said once.
    fn remark(&mut self) {
        let is_with = match self.seat.standing() {
            Some(Standing::Since(_)) => true,
            Some(Standing::Joining(_)) => false,
            None => return,
        };
        if self.was_with.replace(is_with) != Some(is_with) {
            let said = if is_with {
                "the robot is with its team"
            } else {
                "the robot joins its team"
            };
            self.teller.remark(said);
        }
    }
}

fn check(path: &Path, strict: bool) -> Result<(), EndError> {
    let config = Config::load(path)?;
    page::check(understood(&config), &unlikely(&config), strict)
}

/// A configuration in words, a line a subject.
fn understood(config: &Config) -> String {
    let rounds = &config.rounds;
    let mut lines = vec![
        format!("robot        {}", config.robot.name),
        format!(
            "rounds       {} a second, made {} s after their slot",
            rounds.rate_hz, rounds.deadline_s
        ),
        format!("sightings    within {} s of a slot", rounds.skew_s),
    ];
    let peers = config.peers();
    lines.extend(peers.map(|peer| format!("robot {:<6} {}", peer.id, peer.name)));
    lines.join("\n") + "\n"
}

/// What is allowed in the file and was hardly meant.
#[must_use]
pub fn unlikely(config: &Config) -> Vec<String> {
    let mut warnings = Vec::new();
    if !config.makes_rounds() {
        warnings.push("fusion.mode is not \"rounds\": colocd takes no part".to_owned());
    }
    if config.peers().count() == 0 {
        warnings.push("[[team]] has nobody else: there is nobody to make rounds with".to_owned());
    }
    warnings
}

fn status(path: &Path) -> Result<(), EndError> {
    let config = Config::load(path)?;
    let names = Names {
        program: NAME,
        driver: DRIVER,
        source: 0,
        refusals: &Refusal::ALL.map(Refusal::name),
        figures: &FIGURES,
    };
    page::status(&config.open_space(NAME)?, &config.robot.name, &names)
}
