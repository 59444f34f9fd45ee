//! `colocd`: turns encoder frames, sightings, fixes and neighbours' poses into one pose, tick by tick.
//!
//! # Principles
//!
//! * **One thread does the tick**: wait, collect, estimate, publish, account, a module each. After start it never
//!   allocates, locks, logs, formats or touches a file, and blocks in one place only.
//! * **Everything else is somebody else's**: a second, ordinary thread (telemetry) logs, publishes the status,
//!   saves the belief and watches the first.
//! * **Refuse early, survive late**: a wrong configuration opens nothing; once running, whatever comes from outside
//!   is checked, counted under its reason, and never ends the program.

mod args;
pub mod config;

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use clap::Parser;

use args::{Args, Command};
use config::{Config, summary::Summary};

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
        Err(error) => {
            let _ = error.print(); // Nobody is left to tell if standard error is closed.
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
        }
    }
}

fn check(path: &Path) -> ExitCode {
    match Config::load(path) {
        Ok(config) => {
            println!("{}", Summary(&config));
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("colocd: {error}");
            ExitCode::from(2)
        }
    }
}
