//! `coloc listen`: what a robot's daemon says of where it is, for people and for programs.
//!
//! ```text
//! seek (who runs where) ──► follow (silence, losses) ──► form (table, JSON, CSV, TUM) ──► outlet (standard output)
//! ```

mod args;
mod csv;
mod ear;
mod follow;
mod form;
mod hearing;
mod json;
mod outlet;
mod reading;
mod seek;
mod silence;
mod table;
mod tum;

use coloc_shm_types::{OpenError, RobotName};

use crate::estimates::Deaf;
use crate::output::complain;
use crate::status::Status;

pub(crate) use args::ListenArgs;
pub(crate) use reading::{belief, doubted, why_unfit};

/// Why it cannot be listened to.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ListenError {
    #[error(transparent)]
    Open(#[from] OpenError),
    #[error(transparent)]
    Deaf(#[from] Deaf),
    #[error("{robot} runs in {places}: choose one with --root")]
    Several {
        /// Whose estimates are wanted.
        robot: RobotName,
        /// Where all it runs.
        places: String,
    },
    #[error("cannot handle signals: {0}")]
    Signals(std::io::Error),
}

/// The whole command.
pub(crate) fn command(args: &ListenArgs) -> Status {
    follow::run(args).unwrap_or_else(|error| {
        complain(&format!("coloc: {error}"));
        Status::Failed
    })
}
