//! How a refused configuration reads: `robot.toml:12: tick.rate_hz = 5000: must be a number, 1 to 1000 Hz`.

use std::fmt;
use std::path::{Path, PathBuf};

use toml::de::DeTable;

use super::finding::Finding;
use super::location;

/// Why a configuration was refused: everything that was found, a line each, with file, line, value and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConfigError {
    /// The file that was read.
    pub file: PathBuf,
    /// At least one.
    pub problems: Vec<Problem>,
}

/// One thing that is wrong, or unlikely.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Counted from 1; none where it is not a matter of one line.
    pub line: Option<usize>,
    /// What it is, and what is allowed or was meant in all likelihood.
    pub message: String,
}

/// A problem before its line is counted.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    /// Byte of the text.
    pub(super) at: Option<usize>,
    pub(super) message: String,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().enumerate() {
            let end = if index == 0 { "" } else { "\n" };
            write!(f, "{end}{}", problem.in_file(&self.file))?;
        }
        Ok(())
    }
}

impl std::error::Error for ConfigError {}

impl Problem {
    fn new(text: &str, fault: Fault) -> Self {
        Self {
            line: fault.at.map(|byte| line_of(text, byte)),
            message: fault.message,
        }
    }

    fn in_file(&self, file: &Path) -> String {
        let line = self.line.map(|line| format!("{line}:"));
        format!(
            "{}:{} {}",
            file.display(),
            line.unwrap_or_default(),
            self.message
        )
    }
}

/// As much of a line as a person wants to see.
fn shortened(line: &str) -> &str {
    const MOST: usize = 200;
    line.char_indices()
        .nth(MOST)
        .map_or(line, |(end, _)| &line[..end])
}

/// What is allowed and unlikely, a line each, with file, line and what was meant in all likelihood.
pub(super) fn warnings(path: &Path, text: &str, faults: Vec<Fault>) -> Vec<String> {
    let problem = |fault| Problem::new(text, fault).in_file(path);
    faults.into_iter().map(problem).collect()
}

impl ConfigError {
    pub(super) fn unreadable(path: &Path, error: &std::io::Error) -> Self {
        let message = format!("cannot be read: {error}");
        Self::new(path, "", vec![Fault { at: None, message }])
    }

    pub(super) fn new(path: &Path, text: &str, faults: Vec<Fault>) -> Self {
        let problem = |fault| Problem::new(text, fault);
        Self {
            file: path.into(),
            problems: faults.into_iter().map(problem).collect(),
        }
    }
}

impl Fault {
    /// What the parser of TOML says is plain enough; the line itself says the rest.
    pub(super) fn no_toml(error: &toml::de::Error, text: &str) -> Self {
        let at = error.span().map(|span| span.start.min(text.len()));
        let line = at.and_then(|at| text.lines().nth(line_of(text, at) - 1));
        let line = shortened(line.unwrap_or_default().trim());
        let written = error
            .span()
            .and_then(|span| text.get(span))
            .unwrap_or_default();
        let message = match error.message() {
            "duplicate key" => format!("{written} is written twice; keep one: {line}"),
            _ if has_bare_word(line) => format!("not TOML: a text stands in quotes: {line}"),
            message => format!("not TOML: {message}: {line}"),
        };
        Self { at, message }
    }

    /// A text that its own type refuses, in that type's words.
    pub(super) fn no_value(error: &toml::de::Error, document: &DeTable<'_>) -> Self {
        let at = error.span().map(|span| span.start);
        let key = at.and_then(|at| location::key_at(at, document));
        let key = key.map(|key| format!("{key}: ")).unwrap_or_default();
        Self {
            at,
            message: format!("{key}{}", error.message()),
        }
    }

    pub(super) fn found(finding: &Finding, document: &DeTable<'_>) -> Self {
        Self {
            at: location::of_finding(finding, document),
            message: format!("{}{}", finding.key, finding.problem),
        }
    }
}

/// `trigger = timer`, of which the parser says that it is no boolean.
fn has_bare_word(line: &str) -> bool {
    let value = line.split_once('=').map(|(_, value)| value.trim_start());
    value.is_some_and(|value| value.starts_with(char::is_alphabetic))
}

fn line_of(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|&b| b == b'\n').count()
}
