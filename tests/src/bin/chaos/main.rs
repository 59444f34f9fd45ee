//! Kills, stops, starves and robs a fleet of robots, and holds what lives to its promises.
//!
//! Two robots run, with readers and feeders, as processes of their own. A scene does one kind of harm to them, round after
//! round, and looks at everybody after each: whoever was killed answers again within 2 s, whoever was not goes on ticking,
//! nobody panics, and nothing is left behind. What a round does follows from the seed and its number alone.
//!
//! The programs are this one again, in a part of their own (`chaos part ...`), so there is nothing else to build.
#![allow(
    clippy::unwrap_used,
    reason = "what fails here fails the run, and the panic says where"
)]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod alone;
mod args;
mod bars;
mod evidence;
mod fault;
mod files;
mod filler;
mod fleet;
mod harm;
mod litter;
mod paired;
mod parts;
mod program;
mod rounds;
mod scenes;
mod stage;
mod tally;
mod watch;

use std::error::Error;
use std::process::ExitCode;

use clap::Parser;
use coloc_tests::output::{check_place, end};

use args::Args;

fn main() -> ExitCode {
    let args = Args::parse();
    match args.part {
        Some(part) => parts::play(part),
        None => end("chaos", run(&args)),
    }
}

fn run(args: &Args) -> Result<ExitCode, Box<dyn Error>> {
    if args.is_long() {
        bars::hold();
    }
    check_place()?;
    if args.alone {
        alone::settle_in();
    } else {
        alone::begin_again();
    }
    Ok(scenes::run(args))
}
