//! The `colocd` program; all of it is in the library, so that other binaries can be `colocd` too.

use std::process::ExitCode;

fn main() -> ExitCode {
    coloc_daemon::main_from_args(std::env::args_os())
}
