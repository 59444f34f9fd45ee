//! `colocd`, as a program of this package.

use std::process::ExitCode;

fn main() -> ExitCode {
    coloc_daemon::main_from_args(std::env::args_os())
}
