//! Where people read: a terminal, on which a table is drawn over itself, or a file, to which lines are added.

use std::io::{IsTerminal, Write, stderr, stdout};

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

    /// Draws `lines` over those drawn before. Long ones are cut by the terminal, not wrapped.
    pub(crate) fn redraw(&mut self, lines: &[String]) {
        let mut text = String::from("\x1b[?7l");
        if self.drawn > 0 {
            text += &format!("\x1b[{}A", self.drawn);
        }
        lines
            .iter()
            .for_each(|line| text += &format!("\x1b[2K{line}\n"));
        self.drawn = lines.len();
        self.write(&(text + "\x1b[?7h"));
    }

    /// A closed pipe is no reason to stop: the summary is written to a file as well.
    fn write(&self, text: &str) {
        let _ = if self.to_stderr {
            stderr().write_all(text.as_bytes())
        } else {
            stdout()
                .write_all(text.as_bytes())
                .and_then(|()| stdout().flush())
        };
    }
}
