//! How a refused configuration reads: `robot.toml:12: tick.rate_hz = 5000: must be in 1..=1000`.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

/// Why a configuration was refused. One line, naming file, line, value and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConfigError {
    /// The file that was read.
    pub file: PathBuf,
    /// Counted from 1; none when the file could not be read at all.
    pub line: Option<usize>,
    /// What is wrong, and what is allowed.
    pub message: String,
}

/// A value that parses but is not allowed; where it is written is found later.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Dotted key; members of an array by their number: `team.1.id`.
    pub key: String,
    /// The value and what is allowed.
    pub problem: String,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}: {}", self.file.display(), self.message),
            None => write!(f, "{}: {}", self.file.display(), self.message),
        }
    }
}

impl std::error::Error for ConfigError {}

impl ConfigError {
    pub(super) fn unreadable(path: &Path, error: &std::io::Error) -> Self {
        Self {
            file: path.into(),
            line: None,
            message: format!("cannot be read: {error}"),
        }
    }

    pub(super) fn from_toml(error: &toml::de::Error, text: &str, path: &Path) -> Self {
        let line = error.span().map(|span| line_of(text, span.start));
        let value = error
            .span()
            .and_then(|span| text.get(span))
            .filter(|value| !value.contains('\n') && !value.is_empty());
        let message = match value {
            Some(value) if !error.message().contains(value) => {
                format!("`{value}`: {}", error.message())
            }
            _ => error.message().to_owned(),
        };
        Self {
            file: path.into(),
            line,
            message,
        }
    }

    pub(super) fn from_refusal(refusal: &Refusal, text: &str, path: &Path) -> Self {
        let line = find(text, &refusal.key).map(|span| line_of(text, span.start));
        Self {
            file: path.into(),
            line,
            message: format!("{}{}", refusal.key, refusal.problem),
        }
    }
}

fn line_of(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|&b| b == b'\n').count()
}

/// Where `key` is written: its own span, or that of the closest table around it when it was left to its default.
fn find(text: &str, key: &str) -> Option<Range<usize>> {
    let root = DeTable::parse(text).ok()?;
    let mut steps = key.split('.');
    let first = root.get_ref().get(steps.next()?)?;
    let (mut span, mut value) = (first.span(), first.get_ref());
    for step in steps {
        let Some(next) = child(value, step) else {
            break;
        };
        (span, value) = (next.span(), next.get_ref());
    }
    Some(span)
}

fn child<'t, 'i>(value: &'t DeValue<'i>, step: &str) -> Option<&'t toml::Spanned<DeValue<'i>>> {
    match step.parse::<usize>() {
        Ok(index) => value.get(index),
        Err(_) => value.get(step),
    }
}
