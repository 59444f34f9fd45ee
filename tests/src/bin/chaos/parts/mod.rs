//! The programs that a fleet consists of, each a part that this program plays.

mod feeder;
mod launch;
mod reader;
mod tracer;
mod visitor;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use coloc_tests::output::complain;

pub(crate) use reader::monotonic_ns;
pub(crate) use tracer::{CountFrom, TraceArgs};

/// Hidden from the help: nobody types it.
#[derive(Subcommand)]
pub(crate) enum Part {
    /// Plays a part.
    #[command(subcommand, hide = true)]
    Part(Role),
}

/// Which one.
#[derive(Subcommand)]
pub(crate) enum Role {
    /// `colocd`, with its arguments.
    #[command(disable_help_flag = true)]
    Colocd {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<OsString>,
    },
    /// Reads estimates and status of robots.
    Reader(reader::ReaderArgs),
    /// Sends fixes to robots.
    Feeder(Place),
    /// Becomes another program, which then ends with its parent.
    Launch(launch::LaunchArgs),
    /// Enters the space and leaves it.
    Visitor(Place),
    /// Runs another program, and counts its system calls.
    Tracer(TraceArgs),
}

/// A space, and the robots in it.
#[derive(Args, Clone)]
pub(crate) struct Place {
    pub(crate) root: PathBuf,
    pub(crate) prefix: String,
    pub(crate) robots: Vec<String>,
}

pub(crate) fn play(Part::Part(role): Part) -> ExitCode {
    let result = match role {
        Role::Colocd { args } => {
            return coloc_daemon::main_from_args(std::iter::once("colocd".into()).chain(args));
        }
        Role::Reader(args) => reader::read(&args),
        Role::Feeder(place) => feeder::feed(&place),
        Role::Launch(args) => launch::launch(&args),
        Role::Visitor(place) => visitor::visit(&place),
        Role::Tracer(args) => tracer::trace(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            complain(&problem.to_string());
            ExitCode::FAILURE
        }
    }
}
