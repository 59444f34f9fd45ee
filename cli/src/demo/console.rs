//! Where people read: a terminal, on which a table is drawn over itself, or a file, to which lines are added.

use std::io::{IsTerminal, Write, stderr, stdout};

use rustix::termios::{Winsize, tcgetwinsize};

use crate::output::print;

/// Standard output, or standard error where standard output carries JSON.
pub(crate) struct Console {
    to_stderr: bool,
    terminal: bool,
    /// Lines of the picture that the next one is drawn over.
    drawn: usize,
}

impl Console {
    pub(crate) fn new(to_stderr: bool) -> Self {
        let terminal = if to_stderr {
            stderr().is_terminal()
        } else {
            stdout().is_terminal()
        };
        Self {
            to_stderr,
            terminal,
            drawn: 0,
        }
    }

    /// Whether pictures can be redrawn.
    pub(crate) fn is_terminal(&self) -> bool {
        self.terminal
    }

    /// Adds lines that stay.
    pub(crate) fn say(&mut self, text: &str) {
        self.drawn = 0;
        self.write(&format!("{text}\n"));
    }

    /// Draws `lines` over those drawn before. The terminal cuts those that are too long, but wraps the last one, which may
    /// hold something to copy.
    pub(crate) fn redraw(&mut self, lines: &[String]) {
        let Some((last, table)) = lines.split_last() else {
            return;
        };
        let up = if self.drawn > 0 {
            format!("\x1b[{}A", self.drawn)
        } else {
            String::new()
        };
        let table: String = table.iter().map(|line| line.to_owned() + "\n").collect();
        self.write(&format!("{up}\r\x1b[J\x1b[?7l{table}\x1b[?7h{last}\n"));
        self.drawn = lines.len() - 1 + rows(last.chars().count(), self.width());
    }

    /// Columns of the terminal; as many as anyone has if it does not say.
    fn width(&self) -> usize {
        self.size().map_or(0, |size| usize::from(size.ws_col))
    }

    /// Rows of the terminal, if it says.
    pub(crate) fn rows(&self) -> Option<usize> {
        let rows = usize::from(self.size()?.ws_row);
        (rows > 0).then_some(rows)
    }

    fn size(&self) -> Option<Winsize> {
        let size = if self.to_stderr {
            tcgetwinsize(stderr())
        } else {
            tcgetwinsize(stdout())
        };
        size.ok()
    }

    /// A closed pipe is no reason to stop: the summary is written to a file as well.
    fn write(&self, text: &str) {
        if self.to_stderr {
            // Nobody is left to tell.
            let _ = stderr().write_all(text.as_bytes());
        } else {
            print(text);
        }
    }
}

/// Lines that so many characters take; an empty line is one, and a terminal of no width wraps nothing.
fn rows(characters: usize, width: usize) -> usize {
    characters
        .checked_div(width)
        .map_or(1, |_| characters.div_ceil(width).max(1))
}

#[cfg(test)]
mod tests {
    use super::rows;

    #[test]
    fn long_lines_take_as_many_rows_as_they_need() {
        assert_eq!(
            [rows(0, 80), rows(80, 80), rows(81, 80), rows(500, 0)],
            [1, 1, 2, 1]
        );
    }
}
