//! Why nothing could be measured.

use std::fmt::Display;
use std::thread::JoinHandle;

use crate::home::NoHome;
use crate::result_file::WriteError;

/// Why nothing could be measured.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LatencyError {
    #[error("shared memory: {0}")]
    Shm(String),
    #[error("CAN: {0}")]
    Bus(String),
    #[error("cannot start {0}")]
    Spawn(String),
    #[error("the daemon did not come up: {0}")]
    NotUp(String),
    #[error("the {0} broke down")]
    Thread(&'static str),
    #[error("interrupted: what was not measured to its end is not told")]
    Interrupted,
    #[error("the reader's answer makes no sense: {0}")]
    Reader(String),
    #[error(transparent)]
    Home(#[from] NoHome),
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl LatencyError {
    #[allow(clippy::needless_pass_by_value)] // For `map_err`.
    pub(crate) fn shm(reason: impl Display) -> Self {
        Self::Shm(reason.to_string())
    }

    #[allow(clippy::needless_pass_by_value)] // For `map_err`.
    pub(crate) fn bus(reason: impl Display) -> Self {
        Self::Bus(reason.to_string())
    }
}

/// Starts a thread, or says which one could not be started.
pub(crate) fn on_thread<T: Send + 'static>(
    what: &'static str,
    run: impl FnOnce() -> T + Send + 'static,
) -> Result<JoinHandle<T>, LatencyError> {
    let thread = std::thread::Builder::new().spawn(run);
    thread.map_err(|error| LatencyError::Spawn(format!("the {what}: {error}")))
}
