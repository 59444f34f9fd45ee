//! `coloc-gnss`: see the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    coloc_gnss::program::main_from_args(std::env::args_os())
}
