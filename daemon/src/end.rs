//! How a daemon ends, and what its exit status says to whoever started it.
//!
//! `docs/operation.md` has the same table for people.

use coloc_shm_types::{Lost, OpenError, PortError};

use crate::start::StartError;

/// Why it ended, if not because it was asked to.
#[derive(Debug, thiserror::Error)]
pub enum EndError {
    /// It did not start.
    #[error("{0}")]
    Start(#[from] StartError),
    /// The real-time thread cannot go on.
    #[error("the real-time thread has ended, so there are no more estimates: {0}")]
    RealTime(String),
    /// The place of the shared memory was deleted or exchanged.
    #[error("{0}")]
    Lost(#[from] Lost),
    /// `check --strict`, and something is unlikely.
    #[error("with --strict nothing may be unlikely, and there are warnings: {warnings}")]
    Unlikely {
        /// How many.
        warnings: usize,
    },
    /// A result could not be written.
    #[error("standard output cannot be written: {0}")]
    Output(std::io::Error),
}

/// Numbers that scripts and supervisors rely on.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// It could not start; another attempt may succeed.
    Failed = 1,
    /// The arguments or the configuration were not understood; another attempt will not succeed.
    NotUnderstood = 2,
    /// The real-time thread ended.
    RealTimeEnded = 3,
    /// The shared memory was taken away.
    SpaceLost = 4,
    /// Another process acts for this robot, or is this driver of it.
    AlreadyRun = 5,
}

impl EndError {
    /// What it is for whoever started it.
    #[must_use]
    pub fn status(&self) -> Status {
        match self {
            Self::Start(StartError::Config(_)) => Status::NotUnderstood,
            Self::Start(StartError::Space(
                OpenError::AlreadyClaimed { .. } | OpenError::SameNumber { .. },
            )) => Status::AlreadyRun,
            Self::Start(StartError::Port(PortError::Lost(_))) | Self::Lost(_) => Status::SpaceLost,
            Self::Start(_) | Self::Output(_) | Self::Unlikely { .. } => Status::Failed,
            Self::RealTime(_) => Status::RealTimeEnded,
        }
    }
}
