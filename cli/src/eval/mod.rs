//! `coloc eval`: how accurate the estimators are, and how honest, over many runs of a recording or a synthetic world.
//!
//! ```text
//! args ──► setup (world, scenarios) ──► coloc_sim::evaluate, all cores ──► tables, JSON, pictures
//! ```

mod args;
mod conversion;
mod document;
mod figures;
mod number;
mod progress;
mod run;
mod setup;
mod splice;
mod table;
mod tables;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::pictures::PictureError;

pub(crate) use args::EvalArgs;

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
pub(crate) enum EvalCommandError {
    #[error("{0}")]
    Data(#[from] coloc_sim::mrclam::ReadError),
    #[error("{0}")]
    Setting(#[from] coloc_sim::evaluate::EvalError),
    #[error(
        "the scenario {0} needs another number of robots than were recorded: use --synthetic instead of --data"
    )]
    NeedsSynthetic(&'static str),
    #[error("{0} of {1} promises are broken")]
    Broken(usize, usize),
    #[error("cannot write {path}: {reason}", path = path.display())]
    Files { path: PathBuf, reason: String },
    #[error(transparent)]
    Picture(#[from] PictureError),
}

impl EvalCommandError {
    fn files(path: &Path, reason: &impl std::fmt::Display) -> Self {
        Self::Files {
            path: path.into(),
            reason: reason.to_string(),
        }
    }
}

/// The whole command.
pub(crate) fn command(args: &EvalArgs) -> ExitCode {
    match run::run(args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("coloc: {error}");
            ExitCode::FAILURE
        }
    }
}
