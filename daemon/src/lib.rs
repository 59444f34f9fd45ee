//! `colocd`: turns encoder frames, sightings, fixes and neighbours' poses into one pose, tick by tick.
//!
//! # Principles
//!
//! * **One thread does the tick**: wait, collect, estimate, publish, account, a module each. After start it never
//!   allocates, locks, logs, formats or touches a file, and blocks in one place only.
//!   One exception is the middleware's: a program that joins a service later is connected by the first message
//!   after that, which allocates and opens its shared memory (18 to 33 allocations, some 35 µs, once per join).
//! * **Everything else is somebody else's**: a second, ordinary thread (telemetry) words the log, publishes the status and
//!   watches the first; what is written is written by threads that nobody waits for.
//! * **Refuse early, survive late**: a wrong configuration opens nothing; once running, whatever comes from outside
//!   is checked, counted under its reason, and never ends the program.

pub mod account;
mod args;
mod aside;
pub mod clock;
pub mod collect;
pub mod config;
mod deleted;
pub mod end;
pub mod estimate;
pub mod event;
pub mod file_size;
pub mod health;
pub mod hearing;
mod last_words;
mod log;
pub mod memory_limits;
pub mod pace;
pub mod publish;
pub mod realtime;
pub mod record;
mod rehearsal;
mod retry;
pub mod run;
pub mod saved;
pub mod start;
mod stopwatch;
pub mod telemetry;
pub mod tick;
pub mod wait;

use std::ffi::OsString;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use rustix::fs::Mode;

use args::{Args, Command};
use config::{Config, Examined, understood::Understood};
use end::{EndError, Status};
use start::StartError;

/// The whole program, from its arguments (the first is the program's name) to its exit status ([`end::Status`]).
pub fn main_from_args<I, T>(args: I) -> ExitCode
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    file_size::let_writers_see_the_limit();
    match Args::try_parse_from(args) {
        Ok(Args {
            command: Command::Check { config, strict },
        }) => finish(check(&config, strict)),
        Ok(Args {
            command: Command::Run { config },
        }) => finish(run(&config)),
        Err(answer) => explain(&answer),
    }
}

fn check(path: &Path, strict: bool) -> Result<(), EndError> {
    let Examined {
        config,
        mut warnings,
    } = Config::examine(path).map_err(StartError::from)?;
    // It may be checked by somebody else than who runs the robot.
    if let Err(problem) = config.shm_root() {
        warnings.push(format!("a robot of this user could not start: {problem}"));
    }
    if let Err(problem) = config.readers() {
        warnings.push(format!(
            "shm.group: a robot of this user could not start: {problem}"
        ));
    }
    let unlikely = warnings
        .iter()
        .map(|it| format!("{:<13} {it}\n", "warning"));
    let unlikely: String = unlikely.collect();
    let mut output = io::stdout();
    write!(output, "{}{unlikely}", Understood(&config))
        .and_then(|()| output.flush())
        .map_err(EndError::Output)?;
    match warnings.len() {
        0 => Ok(()),
        _ if !strict => Ok(()),
        warnings => Err(EndError::Unlikely { warnings }),
    }
}

fn run(path: &Path) -> Result<(), EndError> {
    // Before anything takes much of it.
    memory_limits::check()?;
    // Some would shut us out of the directories that the middleware makes.
    rustix::process::umask(Mode::RWXG | Mode::RWXO);
    let Examined { config, warnings } = Config::examine(path).map_err(StartError::from)?;
    run::run(&config, &warnings)
}

/// Help that was asked for, or what was wrong with the arguments.
fn explain(answer: &clap::Error) -> ExitCode {
    match answer.print().and_then(|()| io::stdout().flush()) {
        Err(problem) if !answer.use_stderr() => finish(Err(EndError::Output(problem))),
        // If standard error is closed, nobody is left to tell.
        _ if answer.use_stderr() => ExitCode::from(Status::NotUnderstood as u8),
        _ => ExitCode::SUCCESS,
    }
}

fn finish(result: Result<(), EndError>) -> ExitCode {
    let Err(problem) = result else {
        return ExitCode::SUCCESS;
    };
    last_words::say(format!("colocd: {problem}\n"));
    ExitCode::from(problem.status() as u8)
}
