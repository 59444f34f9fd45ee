//! `colocd`, as a program of this package; after the word `coloc-track` that one.
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1).peekable();
    if arguments.peek().is_some_and(|it| it == "coloc-track") {
        return coloc_tracker::program::main_from_args(arguments);
    }
    coloc_daemon::main_from_args(std::env::args_os())
}
