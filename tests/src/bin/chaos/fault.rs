//! What was not as promised.

use std::fmt;

/// In words, with what is known about it.
#[derive(Debug)]
pub(crate) struct Fault {
    words: String,
    /// It came, but too late: a machine that is busy with something else can be the reason.
    pub(crate) is_late: bool,
}

/// Of a round, or of a step of it.
pub(crate) type Outcome<T = ()> = Result<T, Fault>;

impl Fault {
    pub(crate) fn new(words: String) -> Self {
        Self {
            words,
            is_late: false,
        }
    }

    pub(crate) fn late(words: String) -> Self {
        Self {
            words,
            is_late: true,
        }
    }

    /// With what led to it.
    pub(crate) fn after(self, what: &str) -> Self {
        Self {
            words: format!("{what}: {}", self.words),
            ..self
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words)
    }
}

/// Fails with these words.
macro_rules! fault {
    ($($words:tt)*) => { return Err($crate::fault::Fault::new(format!($($words)*))) };
}
pub(crate) use fault;
