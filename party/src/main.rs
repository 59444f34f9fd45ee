//! `coloc-rounds`: see the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    coloc_party::program::main_from_args(std::env::args_os())
}
