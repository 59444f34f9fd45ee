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

mod alone;
mod args;
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

use std::process::ExitCode;

use clap::Parser;

use args::Args;

fn main() -> ExitCode {
    let args = Args::parse();
    if let Some(part) = args.part {
        return parts::play(part);
    }
    if args.alone {
        alone::settle_in();
    } else {
        alone::begin_again();
    }
    scenes::run(&args)
}
