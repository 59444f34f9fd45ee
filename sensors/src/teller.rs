//! The log of a driver: standard error, at most one line a second, and nobody waits for who reads it.

use std::io::{self, Write};
use std::mem::take;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// From one line to the next.
const PAUSE: Duration = Duration::from_secs(1);
/// So many remarks wait for their line; of more, only their number.
const MOST: usize = 8;

/// Collects remarks and says them on one line.
#[derive(Debug)]
pub struct Teller {
    program: &'static str,
    last: Option<Instant>,
    waiting: Vec<String>,
    more: u64,
    lost: u64,
}

impl Teller {
    /// Lines begin with `program`.
    #[must_use]
    pub fn new(program: &'static str) -> Self {
        Self {
            program,
            last: None,
            waiting: Vec::new(),
            more: 0,
            lost: 0,
        }
    }

    /// Takes in a remark. What is waiting already is not said twice.
    pub fn remark(&mut self, text: impl Into<String>) {
        let text = text.into();
        if self.waiting.contains(&text) {
            return;
        }
        if self.waiting.len() < MOST {
            self.waiting.push(text);
        } else {
            self.more += 1;
        }
    }

    /// Says what has come together, if a second is over since the last line.
    pub fn tell(&mut self, now: Instant) {
        let is_due = self.last.is_none_or(|last| now >= last + PAUSE);
        if is_due && let Some(line) = self.line() {
            self.last = Some(now);
            self.write(&line);
        }
    }

    /// Says what is left.
    pub fn finish(&mut self) {
        if let Some(line) = self.line() {
            self.write(&line);
        }
    }

    /// The line that is due, if there is anything to say.
    fn line(&mut self) -> Option<String> {
        if self.waiting.is_empty() {
            return None;
        }
        let mut line = format!("{}: {}", self.program, take(&mut self.waiting).join("; "));
        match take(&mut self.more) {
            0 => {}
            more => line.extend(["; and ", &more.to_string(), " more remarks"]),
        }
        match take(&mut self.lost) {
            0 => {}
            lost => line.extend(["; ", &lost.to_string(), " lines before found no reader"]),
        }
        Some(line + "\n")
    }

    fn write(&mut self, line: &str) {
        let stderr = io::stderr();
        if !takes_some(&stderr) || stderr.lock().write_all(line.as_bytes()).is_err() {
            self.lost += 1;
        }
    }
}

/// A pipe that takes some takes a whole page.
fn takes_some(stderr: &io::Stderr) -> bool {
    let mut asked = [PollFd::new(stderr, PollFlags::OUT)];
    let at_once = Timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    poll(&mut asked, Some(&at_once)).is_ok_and(|ready| ready > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remarks_of_one_second_are_one_line() {
        let mut teller = Teller::new("coloc-x");
        assert_eq!(teller.line(), None);
        for text in ["a", "b", "a"] {
            teller.remark(text);
        }
        assert_eq!(teller.line().unwrap(), "coloc-x: a; b\n");
        (0..10).for_each(|number| teller.remark(number.to_string()));
        let line = teller.line().unwrap();
        assert!(line.ends_with("; 7; and 2 more remarks\n"), "{line}");
        assert_eq!(teller.line(), None);
    }

    #[test]
    fn a_second_line_waits_for_its_second() {
        let mut teller = Teller::new("coloc-x");
        let now = Instant::now();
        teller.remark("first");
        teller.tell(now);
        teller.remark("second");
        teller.tell(now + PAUSE / 2);
        assert_eq!(teller.waiting, ["second"]);
        teller.tell(now + PAUSE);
        assert!(teller.waiting.is_empty());
    }
}
