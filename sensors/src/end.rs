//! How a driver ends, and what its exit status says: the same as `colocd`'s (`docs/operation.md`).

use std::io::{self, Write};
use std::process::ExitCode;

use coloc_daemon::config::ConfigError;
use coloc_daemon::end::Status;
use coloc_shm_types::places::NoPlace;
use coloc_shm_types::private::NotPrivate;
use coloc_shm_types::{Lost, OpenError, PortError};

/// Why it ended, if not because it was asked to or its file was at its end.
#[derive(Debug, thiserror::Error)]
pub enum EndError {
    /// The configuration is wrong.
    #[error("{0}")]
    Config(#[from] ConfigError),
    /// There is no place for shared memory.
    #[error("{0}")]
    Place(#[from] NoPlace),
    /// Shared memory could not be entered.
    #[error("{0}")]
    Space(#[from] OpenError),
    /// A channel could not be opened.
    #[error("{0}")]
    Port(#[from] PortError),
    /// Shared memory was deleted or exchanged.
    #[error("{0}")]
    Lost(#[from] Lost),
    /// A file of its own is not safe.
    #[error("{0}")]
    Private(#[from] NotPrivate),
    /// A file that can be read once cannot be read.
    #[error("{0}")]
    Input(String),
    /// `check --strict`, and something is unlikely.
    #[error("with --strict nothing may be unlikely, and there are warnings: {0}")]
    Unlikely(usize),
    /// The operating system refused something.
    #[error("{what}: {error}")]
    System {
        /// What was tried.
        what: &'static str,
        /// What it said.
        error: io::Error,
    },
}

impl EndError {
    /// What the operating system said to what was tried.
    pub fn of(what: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |error| Self::System { what, error }
    }

    /// What it is for whoever started it.
    #[must_use]
    pub fn status(&self) -> Status {
        match self {
            Self::Config(_) => Status::NotUnderstood,
            Self::Lost(_) | Self::Port(PortError::Lost(_)) => Status::SpaceLost,
            Self::Space(OpenError::DriverRuns { .. }) => Status::AlreadyRun,
            _ => Status::Failed,
        }
    }
}

/// Says why it ended, as `program`, and with which status.
#[must_use]
pub fn finish(program: &str, result: Result<(), EndError>) -> ExitCode {
    let Err(problem) = result else {
        return ExitCode::SUCCESS;
    };
    // If this fails there is nowhere left to say so.
    let _ = io::stderr().write_all(format!("{program}: {problem}\n").as_bytes());
    ExitCode::from(problem.status() as u8)
}
