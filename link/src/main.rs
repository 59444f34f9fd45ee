//! `coloc-link`.
use std::process::ExitCode;

fn main() -> ExitCode {
    coloc_link::program::main_from_args(std::env::args_os())
}
