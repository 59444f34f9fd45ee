//! `colocd`: turns encoder frames, sightings, fixes and neighbours' poses into one pose, tick by tick.
//!
//! # Principles
//!
//! * **One thread does the tick**: wait, collect, estimate, publish, account, a module each. After start it never
//!   allocates, locks, logs, formats or touches a file, and blocks in one place only.
//!   One exception is the middleware's: a program that joins a service later is connected by the first message
//!   after that, which allocates and opens its shared memory (18 to 33 allocations, some 35 µs, once per join).
//! * **Everything else is somebody else's**: a second, ordinary thread (telemetry) logs, publishes the status,
//!   saves the belief and watches the first.
//! * **Refuse early, survive late**: a wrong configuration opens nothing; once running, whatever comes from outside
//!   is checked, counted under its reason, and never ends the program.

pub mod account;
mod args;
pub mod clock;
pub mod collect;
pub mod config;
pub mod estimate;
pub mod event;
pub mod health;
pub mod ledger;
pub mod publish;
pub mod realtime;
pub mod record;
pub mod run;
pub mod saved;
pub mod start;
pub mod telemetry;
pub mod tick;
pub mod wait;

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use coloc_shm_types::OpenError;

use args::{Args, Command};
use config::{Config, summary::Summary};
use start::StartError;

/// The whole program, from its arguments (the first is the program's name) to its exit status:
/// 0 done, 1 failed, 2 not understood (arguments or configuration).
pub fn main_from_args<I, T>(args: I) -> ExitCode
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    match Args::try_parse_from(args) {
        Ok(Args {
            command: Command::Check { config },
        }) => check(&config),
        Ok(Args {
            command: Command::Run { config },
        }) => run(&config),
        Err(error) => {
            let _ = error.print(); // Nobody is left to tell if standard error is closed.
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
        }
    }
}

fn check(path: &Path) -> ExitCode {
    finish(
        Config::load(path)
            .map_err(StartError::from)
            .and_then(|config| {
                config.shm_root().map_err(OpenError::from)?;
                println!("{}", Summary(&config));
                Ok(())
            }),
    )
}

fn run(path: &Path) -> ExitCode {
    finish(
        Config::load(path)
            .map_err(StartError::from)
            .and_then(|config| run::run(&config)),
    )
}

fn finish(result: Result<(), StartError>) -> ExitCode {
    let Err(problem) = result else {
        return ExitCode::SUCCESS;
    };
    eprintln!("colocd: {problem}");
    match problem {
        StartError::Config(_) => ExitCode::from(2),
        _ => ExitCode::FAILURE,
    }
}
