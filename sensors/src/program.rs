//! A program of a sensor, from its arguments to its exit status. All have `run`, `check` and `status`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Arg, ArgAction, ArgMatches, Args, Command, value_parser};
use coloc_daemon::config::Config;
use coloc_shm_types::Space;

use crate::end::{self, EndError};
use crate::input::InputSpec;
use crate::page::{self, Names};
use crate::stop::Stop;
use crate::voice::{As, Voice};

/// What a program is, beside what all are.
pub trait Program {
    /// Its name.
    const NAME: &'static str;
    /// The driver in its status.
    const DRIVER: &'static str;
    /// What it is for, a sentence.
    const ABOUT: &'static str;
    /// What `run` does, a sentence.
    const RUN: &'static str;
    /// The section of `robot.toml` that it needs.
    const SECTION: &'static str;
    /// What its health is of, for people: `the scanner`.
    const HEARD: &'static str;
    /// Names of its figures, in their order.
    const FIGURES: &'static [&'static str];
    /// What it reads of `robot.toml`.
    type Settings;

    /// Names of its reasons to refuse, in their order.
    fn refusals() -> Vec<&'static str>;

    /// Reads a configuration.
    ///
    /// # Errors
    /// What is wrong with it.
    fn load(path: &Path) -> Result<(Config, Self::Settings), EndError>;

    /// The number of its sensor, where a robot has several.
    #[must_use]
    fn source(_: &Self::Settings) -> u16 {
        0
    }

    /// A configuration in words, a line a subject.
    fn understood(config: &Config, settings: &Self::Settings) -> String;

    /// What is allowed in the file and was hardly meant.
    fn unlikely(config: &Config, settings: &Self::Settings) -> Vec<String>;

    /// Does what it is for, until asked to end.
    ///
    /// # Errors
    /// Why it could not go on.
    fn run(start: Start<'_, Self::Settings>) -> Result<(), EndError>;

    /// Commands of its own.
    #[must_use]
    fn others() -> Vec<Other> {
        Vec::new()
    }
}

type Act = dyn Fn(&ArgMatches) -> Result<(), EndError>;

/// A command that only one program has.
pub struct Other {
    command: Command,
    act: Box<Act>,
}

impl Other {
    /// The command `name` with the arguments `A`, and what it does.
    #[must_use]
    pub fn new<A: Args + 'static>(name: &'static str, act: fn(A) -> Result<(), EndError>) -> Self {
        Self {
            command: A::augment_args(Command::new(name)),
            act: Box::new(move |matches| {
                let args = A::from_arg_matches(matches);
                act(args.map_err(|error| EndError::Input(error.to_string()))?)
            }),
        }
    }
}

/// What a program has once it has begun.
#[derive(Debug)]
pub struct Start<'a, S> {
    /// Of the configuration.
    pub path: &'a Path,
    /// What all programs read of it.
    pub config: &'a Config,
    /// What this one reads of it.
    pub settings: S,
    /// The robot's shared memory.
    pub space: &'a Space,
    /// Whether it is asked to end.
    pub stop: &'a Stop,
    /// What it says of itself.
    pub voice: Voice<'a>,
}

impl<S> Start<'_, S> {
    /// Files that the configuration names are beside it.
    #[must_use]
    pub fn below(&self, spec: InputSpec) -> InputSpec {
        spec.below(self.path.parent().unwrap_or(Path::new("")))
    }
}

/// The whole program, from its arguments to its exit status.
#[must_use]
pub fn main_from_args<P: Program>(
    args: impl IntoIterator<Item = impl Into<OsString> + Clone>,
) -> ExitCode {
    coloc_daemon::file_size::let_writers_see_the_limit();
    match command::<P>().try_get_matches_from(args) {
        Ok(matches) => end::finish(P::NAME, act::<P>(&matches)),
        Err(answer) => {
            // If nobody reads it, nobody is left to tell.
            let _ = answer.print();
            ExitCode::from(u8::from(answer.use_stderr()) * 2)
        }
    }
}

const RUN: &str = "run";
const CHECK: &str = "check";
const STATUS: &str = "status";
const STRICT: &str = "strict";
const CONFIG: &str = "config";

/// What each of them is told: the robot's configuration.
fn config_argument() -> Arg {
    Arg::new(CONFIG)
        .required(true)
        .value_parser(value_parser!(PathBuf))
        .help("The robot's configuration")
}

fn config_of(matches: &ArgMatches) -> &Path {
    let config = matches.get_one::<PathBuf>(CONFIG);
    config.expect("clap refuses a command without it")
}

fn command<P: Program>() -> Command {
    let section = format!("The robot's configuration, with a section [{}]", P::SECTION);
    let strict = Arg::new(STRICT)
        .long(STRICT)
        .action(ArgAction::SetTrue)
        .help("End with status 1 if anything is unlikely");
    Command::new(P::NAME)
        .version(env!("CARGO_PKG_VERSION"))
        .about(P::ABOUT)
        .arg_required_else_help(true)
        .subcommand_required(true)
        .subcommand(Command::new(RUN).about(P::RUN).arg(config_argument().help(section)))
        .subcommand(
            Command::new(CHECK)
                .about("Read a configuration, say what it means and what is unlikely about it, open nothing")
                .arg(config_argument())
                .arg(strict),
        )
        .subcommands(P::others().into_iter().map(|it| it.command))
        .subcommand(
            Command::new(STATUS)
                .about(format!("Print the status of the {} that runs with this configuration, once", P::NAME))
                .arg(config_argument()),
        )
}

fn act<P: Program>(matches: &ArgMatches) -> Result<(), EndError> {
    match matches.subcommand() {
        Some((RUN, matches)) => begin::<P>(config_of(matches), P::DRIVER, P::run),
        Some((CHECK, matches)) => check::<P>(config_of(matches), matches.get_flag(STRICT)),
        Some((STATUS, matches)) => status::<P>(config_of(matches)),
        Some((name, matches)) => {
            let others = P::others();
            let other = others.iter().find(|it| it.command.get_name() == name);
            other.map_or(Ok(()), |it| (it.act)(matches))
        }
        None => Ok(()),
    }
}

/// Enters the robot's shared memory as `driver`, and goes on with `go`.
///
/// # Errors
/// If it cannot, or another process is that driver already; and those of `go`.
pub fn begin<P: Program>(
    path: &Path,
    driver: &'static str,
    go: impl FnOnce(Start<'_, P::Settings>) -> Result<(), EndError>,
) -> Result<(), EndError> {
    let stop = Stop::on_signals().map_err(EndError::of("signals cannot be handled"))?;
    let (config, settings) = P::load(path)?;
    let space = config.open_space(P::NAME)?;
    let who = As {
        program: P::NAME,
        driver,
        source: P::source(&settings),
        heard: P::HEARD,
    };
    let voice = Voice::open(&space, &config.robot.name, who)?;
    go(Start {
        path,
        config: &config,
        settings,
        space: &space,
        stop: &stop,
        voice,
    })
}

fn check<P: Program>(path: &Path, strict: bool) -> Result<(), EndError> {
    let (config, settings) = P::load(path)?;
    let warnings = P::unlikely(&config, &settings);
    page::check(P::understood(&config, &settings), &warnings, strict)
}

fn status<P: Program>(path: &Path) -> Result<(), EndError> {
    let (config, settings) = P::load(path)?;
    let names = Names {
        program: P::NAME,
        driver: P::DRIVER,
        source: P::source(&settings),
        refusals: &P::refusals(),
        figures: P::FIGURES,
    };
    page::status(&config.open_space(P::NAME)?, &config.robot.name, &names)
}
