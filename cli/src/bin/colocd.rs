//! The `colocd` program; all of it is in the daemon's library.

#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::process::ExitCode;

fn main() -> ExitCode {
    coloc_daemon::main_from_args(std::env::args_os())
}
