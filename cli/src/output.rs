//! Standard output.

use std::io::{Write, stdout};

/// Prints a line. A reader that has seen enough and closed the pipe is no error.
pub(crate) fn print_line(text: &str) {
    let _ = writeln!(stdout(), "{text}");
}
