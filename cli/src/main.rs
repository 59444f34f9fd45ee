//! coloc: what a person types.
//!
//! # Principles
//!
//! * **What is shown is the product.** The demo runs real `colocd` processes, fed through real buses and real shared
//!   memory; nothing in this crate estimates anything.
//! * **Leave nothing behind.** Every process, file and interface that a command makes ends with it, however it ends.
//! * **Say it once, say what to do.** A command fails with one line on standard error and a non-zero status.
//! * **Lose no result.** What was asked for is tried before anything is computed, and written as far as it can be, whatever
//!   became of the other outputs.
//!
//! The program is `colocd` as well: called by that name, or with `colocd` as its first argument, it is the daemon. So it
//! brings everything that the demo starts. What flies is the other program of this package, `colocd`: the daemon alone.

#![warn(clippy::print_stdout, clippy::print_stderr)] // They panic: see `output`.

mod args;
mod calibrate;
mod comparison;
mod daemon;
mod demo;
mod estimates;
mod eval;
mod first_robot;
mod fitted;
mod home;
mod latency;
mod leaders;
mod list;
mod listen;
mod observable;
mod output;
mod pictures;
mod place;
mod pose;
mod result_file;
mod robot_file;
mod status;
mod survey;

use std::process::ExitCode;

use args::{Command, parse};

fn main() -> ExitCode {
    coloc_daemon::file_size::let_writers_see_the_limit();
    if let Some(args) = daemon::arguments(std::env::args_os()) {
        return daemon::run(args);
    }
    let status = match parse(std::env::args_os()) {
        Ok(Command::Calibrate(args)) => calibrate::command(&args),
        Ok(Command::Demo(args)) => demo::command(&args),
        Ok(Command::Eval(args)) => eval::command(&args),
        Ok(Command::FirstRobot(args)) => first_robot::command(&args),
        Ok(Command::Leaders(args)) => leaders::command(&args),
        Ok(Command::Latency(args)) => latency::command(&args),
        Ok(Command::LatencyReader(args)) => latency::reader(&args),
        Ok(Command::List(args)) => list::command(&args),
        Ok(Command::Listen(args)) => listen::command(&args),
        Ok(Command::Observable(args)) => observable::command(&args),
        Ok(Command::Pose(args)) => pose::command(&args),
        Ok(Command::Survey(args)) => survey::command(&args),
        Ok(Command::Check { config, strict }) => return daemon::check(&config, strict),
        Ok(Command::Laser { args }) => return daemon::run_laser(args),
        Ok(Command::Colocd { args }) => return daemon::run_with(args),
        Err(answer) => answer,
    };
    output::settle(status).into()
}
