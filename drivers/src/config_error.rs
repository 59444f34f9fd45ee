//! Why a configuration of the wheels, or the DBC file that it names, can't be used.

use std::io;
use std::path::PathBuf;

use crate::signal::SignalError;

/// Why a configuration can't be used: names the setting and what is allowed.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The DBC file can't be read.
    #[error("dbc: can't read {path}: {error}")]
    ReadDbc {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// The DBC file is not one.
    #[error("dbc: {path} is no DBC file: {problem}")]
    ParseDbc {
        /// The file.
        path: PathBuf,
        /// Where and why.
        problem: String,
    },
    /// No message of that name.
    #[error("the DBC file has no message '{message}'; it has {available}")]
    UnknownMessage {
        /// What was asked for.
        message: String,
        /// What there is.
        available: String,
    },
    /// No signal of that name.
    #[error("message {message} has no signal '{signal}'; it has {available}")]
    UnknownSignal {
        /// Where it was looked for.
        message: String,
        /// What was asked for.
        signal: String,
        /// What there is.
        available: String,
    },
    /// The signal's description can't be used.
    #[error("signal {signal} of message {message}: {error}")]
    Signal {
        /// The message.
        message: String,
        /// The signal.
        signal: String,
        /// What is wrong with it.
        error: SignalError,
    },
    /// The message's identifier is wider than CAN's.
    #[error(
        "message {message} in line {line} of the DBC file has the identifier {id} ({id:#X}), which is wider than {}", wide(*.id)
    )]
    Identifier {
        /// The message.
        message: String,
        /// Its identifier as the DBC file has it.
        id: u64,
        /// Where, counted from 1.
        line: usize,
    },
    /// The DBC file says two things, or something that may or may not be meant.
    #[error("dbc: {problem}")]
    Ambiguous {
        /// What it says, and where.
        problem: String,
    },
    /// A setting, alone or together with others, makes no sense.
    #[error("{setting}: {problem}")]
    Setting {
        /// Its name.
        setting: String,
        /// What is wrong and what is allowed.
        problem: String,
    },
}

/// What an identifier of a DBC file should have fitted into.
fn wide(id: u64) -> String {
    if id & (1 << 31) != 0 {
        return "29 bits".to_owned();
    }
    format!(
        "11 bits and not marked as extended: an extended identifier is written with bit 31 set, here {}",
        id | 1 << 31
    )
}

impl ConfigError {
    pub(crate) fn ambiguous(problem: String) -> Self {
        Self::Ambiguous { problem }
    }

    pub(crate) fn setting(setting: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Setting {
            setting: setting.into(),
            problem: problem.into(),
        }
    }
}
