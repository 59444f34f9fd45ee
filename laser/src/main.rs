//! `coloc-laser`: see the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    coloc_laser::program::main_from_args(std::env::args_os())
}
