//! coloc: what a person types.
//!
//! # Principles
//!
//! * **What is shown is the product.** The demo runs real `colocd` processes, fed through real buses and real shared
//!   memory; nothing in this crate estimates anything.
//! * **Leave nothing behind.** Every process, file and interface that a command makes ends with it, however it ends.
//! * **Say it once, say what to do.** A command fails with one line on standard error and a non-zero status.
//!
//! The program is `colocd` as well: called by that name, or with `colocd` as its first argument, it is the daemon. So one
//! build brings everything that the demo starts.

mod args;
mod comparison;
mod daemon;
mod demo;
mod eval;
mod latency;
mod output;
mod pictures;

use std::process::ExitCode;

use args::{Command, parse};

fn main() -> ExitCode {
    if let Some(args) = daemon::arguments(std::env::args_os()) {
        return daemon::run(args);
    }
    match parse(std::env::args_os()) {
        Ok(Command::Demo(args)) => demo::command(&args),
        Ok(Command::Eval(args)) => eval::command(&args),
        Ok(Command::Latency(args)) => latency::command(&args),
        Ok(Command::LatencyReader(args)) => latency::reader(&args),
        Ok(Command::Check { config }) => daemon::check(&config),
        Ok(Command::Colocd { args }) => daemon::run_with(args),
        Err(answer) => answer,
    }
}
