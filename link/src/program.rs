//! The program `coloc-link`.
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use coloc_daemon::config::Config;
use coloc_sensors::page::{self, Names};
use coloc_sensors::{EndError, Stop, end};
use coloc_shm_types::private::OwnFile;

use crate::check;
use crate::fleet::{self, Fleet};
use crate::keys::{Identity, ROBOT_KEY, load_team};
use crate::post::{self, FIGURES, Office, Papers, REASONS};
use crate::rehearsal::{self, NetworksArgs, RosterArgs, WeatherArgs};
use crate::roster::{Book, FLEET, Roster, fingerprint};
use crate::section::Link;
use crate::wire::Versions;
use crate::wrong_clock::WrongClock;

const NAME: &str = "coloc-link";
const DRIVER: &str = "link";

/// Carries what robots say to one another between computers.
#[derive(Debug, Parser)]
#[command(name = NAME, version, arg_required_else_help = true)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Carry what the robot says, and what others say to it, until SIGINT or SIGTERM.
    Run {
        /// The robot's configuration, with a section [link].
        config: PathBuf,
        /// A rehearsal: others see a clock that is so much off (s), gains so much (ppm), from so many seconds after the start.
        #[arg(
            long,
            hide = true,
            value_name = "OFFSET,DRIFT,AFTER",
            allow_hyphen_values = true
        )]
        wrong_clock: Option<WrongClock>,
    },
    #[command(hide = true)]
    RehearsalRoster(RosterArgs),
    #[command(hide = true)]
    Weather(WeatherArgs),
    #[command(hide = true)]
    Networks(NetworksArgs),
    /// Begin and change a team.
    #[command(subcommand)]
    Fleet(Fleet),
    /// Say whether keys, roster and clock are as they have to be, and who is reached.
    Check {
        /// The robot's configuration.
        config: PathBuf,
        /// Fail if something is not as it should be.
        #[arg(long)]
        strict: bool,
    },
    /// Print the status of the coloc-link that runs with this configuration, once.
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
            Command::Run {
                config,
                wrong_clock,
            } => run(&config, wrong_clock.unwrap_or_default()),
            Command::RehearsalRoster(args) => rehearsal::write_roster(&args),
            Command::Weather(args) => {
                rehearsal::end_with_the_demo().and_then(|()| rehearsal::make_weather(&args))
            }
            Command::Networks(args) => {
                rehearsal::end_with_the_demo().and_then(|()| rehearsal::make_networks(&args))
            }
            Command::Fleet(command) => fleet::run(command),
            Command::Check { config, strict } => check::run(&config, strict),
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

fn run(path: &Path, clock: WrongClock) -> Result<(), EndError> {
    rehearsal::end_with_the_demo()?;
    let stop = Stop::on_signals().map_err(EndError::of("signals cannot be handled"))?;
    post::run(Office::open(papers(path)?)?.with_clock(clock), &stop)
}

/// What a link is opened with, from the robot's configuration and its own directory.
///
/// # Errors
/// What is missing or wrong.
pub fn papers(path: &Path) -> Result<Papers, EndError> {
    let (config, section) = Config::load_with::<Link>(path)?;
    let directory = section.own_directory(&config)?;
    let (identity, text, team) = if section.insecure {
        let identity = Identity::insecure(config.robot.id);
        (
            identity,
            roster_text(&directory)?,
            Identity::insecure(0).public(),
        )
    } else {
        let problem = |error: crate::keys::KeyError| EndError::Input(error.to_string());
        let identity = Identity::load(&directory, ROBOT_KEY).map_err(problem)?;
        let team = load_team(&directory).map_err(problem)?;
        (identity, roster_text(&directory)?, team)
    };
    let book = Book::open(text, team).map_err(|error| EndError::Input(error.to_string()))?;
    Ok(Papers {
        config,
        section,
        directory,
        identity,
        book,
        origin: origin(path)?,
        versions: Versions::OWN,
    })
}

/// [`fingerprint`] of `[gnss.datum]`, where robots that have receivers begin their frame; 0 if there is none.
fn origin(path: &Path) -> Result<u64, EndError> {
    let text = std::fs::read_to_string(path).map_err(EndError::of("it cannot be read again"))?;
    let table: toml::Table = toml::from_str(&text).unwrap_or_default();
    let datum = table.get("gnss").and_then(|gnss| gnss.get("datum"));
    let configured = datum.filter(|datum| datum.get("latitude_deg").is_some());
    Ok(configured.map_or(0, fingerprint_of_datum))
}

/// As numbers, so that 10 and 10.0 are the same.
fn fingerprint_of_datum(datum: &toml::Value) -> u64 {
    #[expect(clippy::cast_precision_loss, reason = "degrees and metres")]
    let number = |value: &toml::Value| {
        let whole = value.as_integer().map(|it| it as f64);
        value.as_float().or(whole).unwrap_or(f64::NAN)
    };
    let names = ["latitude_deg", "longitude_deg", "height_m"];
    let numbers = names.map(|name| datum.get(name).map_or(0.0, number));
    fingerprint(&format!("{numbers:?}"))
}

fn roster_text(directory: &Path) -> Result<String, EndError> {
    let path = directory.join(FLEET);
    let limit = u64::try_from(Roster::LONGEST).unwrap_or(u64::MAX);
    let read = OwnFile::named(&path).and_then(|file| file.read(limit))?;
    let missing = || {
        EndError::Input(format!(
            "there is no roster at {}: make one with `coloc-link fleet`",
            path.display()
        ))
    };
    read.ok_or_else(missing)
}

fn status(path: &Path) -> Result<(), EndError> {
    let (config, _) = Config::load_with::<Link>(path)?;
    let names = Names {
        program: NAME,
        driver: DRIVER,
        source: config.robot.id,
        refusals: &REASONS,
        figures: &FIGURES,
    };
    page::status(&config.open_space(NAME)?, &config.robot.name, &names)
}
