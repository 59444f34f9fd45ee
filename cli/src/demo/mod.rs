//! `coloc demo`: a team of real daemons, fed with what robots would feel, measured against where they are.
//!
//! ```text
//! world ──► feed ──► CAN frames, sightings, fixes ──► five colocd (fleet) ──► estimates ──► watch ──► table, summary, pictures
//!   └──────────────────────────── truth ──────────────────────────────────────────────────────┘
//! ```

mod bars;
pub(crate) mod bus;
pub(crate) mod clock;
mod console;
mod feed;
mod feed_thread;
mod fleet;
mod out;
mod process;
mod record;
mod robot_file;
mod run;
mod show;
mod summary;
mod table;
mod watch;
mod world;

use std::fmt::Display;
use std::path::Path;
use std::process::ExitCode;

use crate::args::DemoArgs;
use crate::pictures::PictureError;
use console::Console;

/// Begins the name of every file of the demo in shared memory.
const PREFIX: &str = "colocdemo";

/// Why the demo could not run.
#[derive(Debug, thiserror::Error)]
pub(crate) enum DemoError {
    #[error("{0}")]
    World(String),
    #[error("{0}")]
    Files(String),
    #[error("shared memory: {0}")]
    Shm(String),
    #[error("CAN: {0}")]
    Bus(String),
    #[error("cannot start a daemon: {0}")]
    Spawn(String),
    #[error("the daemon of {robot} did not come up: {last_words}")]
    NotUp { robot: String, last_words: String },
    #[error("the feed of sensors broke down")]
    Feed,
    #[error(transparent)]
    Picture(#[from] PictureError),
    #[error("{0}")]
    Missed(String),
}

impl DemoError {
    fn files(path: &Path, reason: &dyn Display) -> Self {
        Self::Files(format!("cannot write {}: {reason}", path.display()))
    }

    #[allow(clippy::needless_pass_by_value)] // For `map_err`.
    fn shm(reason: impl Display) -> Self {
        Self::Shm(reason.to_string())
    }
}

/// The whole command.
pub(crate) fn command(args: &DemoArgs) -> ExitCode {
    let mut console = Console::new(args.json);
    match run::run(args, &mut console) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("coloc: {error}");
            ExitCode::FAILURE
        }
    }
}
