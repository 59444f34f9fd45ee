//! `coloc-bounds`: see the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    coloc_monitor::program::main_from_args(std::env::args_os())
}
