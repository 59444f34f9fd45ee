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
mod outputs;
mod progress;
mod run;
mod scale;
mod setup;
mod sightings;
mod splice;
pub(crate) mod table;
mod tables;

use crate::output::complain;
use crate::result_file::WriteError;
use crate::status::Status;

pub(crate) use args::EvalArgs;

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
pub(crate) enum EvalCommandError {
    #[error("{0}")]
    Data(#[from] coloc_sim::mrclam::ReadError),
    #[error("{path}: {1}", path = .0.display())]
    Unusable(std::path::PathBuf, coloc_sim::partial::Unusable),
    #[error("{0}")]
    Setting(#[from] coloc_sim::evaluate::EvalError),
    #[error(
        "the scenario {0} needs another number of robots than were recorded: use --synthetic instead of --data"
    )]
    NeedsSynthetic(&'static str),
    #[error("{0} of {1} promises are broken")]
    Broken(usize, usize),
    #[error(
        "cannot compute on so many threads as --threads or RAYON_NUM_THREADS and the system's limits say: {0}"
    )]
    Threads(#[from] rayon::ThreadPoolBuildError),
    #[error("cannot draw PNG: {0}")]
    Fonts(&'static str),
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// The whole command.
pub(crate) fn command(args: &EvalArgs) -> Status {
    match run::run(args) {
        Ok(()) => Status::Done,
        Err(error) => {
            complain(&format!("coloc: {error}"));
            Status::Failed
        }
    }
}
