//! `coloc demo`: a team of real daemons, fed with what robots would feel, measured against where they are.
//!
//! ```text
//! world ──► feed ──► CAN frames, sightings, fixes ──► five colocd (fleet) ──► estimates ──► watch ──► table, summary, pictures
//!   └──────────────────────────── truth ──────────────────────────────────────────────────────┘
//! ```
//!
//! What is played is a [`scene`]. In tests a rehearsal plays the same without daemons.

mod anew;
mod bars;
pub(crate) mod bus;
mod bystanders;
mod children;
pub(crate) mod clock;
mod console;
mod eye;
mod feed;
mod feed_thread;
mod fleet;
mod glimpses;
pub(crate) mod interrupt;
mod lead;
mod links;
mod out;
mod process;
mod record;
#[cfg(test)]
mod rehearsal;
mod robot_file;
mod run;
pub(crate) mod scene;
mod show;
mod spaces;
mod summary;
mod table;
mod tale;
mod told;
mod watch;
mod wheels;
mod world;

use std::fmt::Display;

use crate::args::DemoArgs;
use crate::home::{Kind, NoHome};
use crate::output::complain;
use crate::result_file::WriteError;
use crate::status::Status;
use console::Console;

/// Begins the name of every file of the demo in shared memory.
const PREFIX: &str = "colocdemo";

/// What it keeps while it runs.
const HOME: Kind = Kind {
    name: "coloc-demo-",
    shm_prefix: PREFIX,
};

/// Why the demo could not run.
#[derive(Debug, thiserror::Error)]
pub(crate) enum DemoError {
    #[error("{0}")]
    World(String),
    #[error("shared memory: {0}")]
    Shm(String),
    #[error("CAN: {0}")]
    Bus(String),
    #[error("cannot start the feed of sensors: {0}")]
    Thread(String),
    #[error("cannot start a daemon: {0}")]
    Spawn(String),
    #[error("the daemon of {robot} did not come up: {last_words}")]
    NotUp { robot: String, last_words: String },
    #[error("coloc-link of {robot} has ended: {last_words}")]
    Link { robot: String, last_words: String },
    #[error("coloc-laser of {robot} has ended: {last_words}")]
    Laser { robot: String, last_words: String },
    #[error("the feed of sensors broke down")]
    Feed,
    #[error(transparent)]
    Home(#[from] NoHome),
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl DemoError {
    #[allow(clippy::needless_pass_by_value)] // For `map_err`.
    fn shm(reason: impl Display) -> Self {
        Self::Shm(reason.to_string())
    }

    #[allow(clippy::needless_pass_by_value)] // The same.
    fn spawn(reason: impl Display) -> Self {
        Self::Spawn(reason.to_string())
    }
}

/// The whole command.
pub(crate) fn command(args: &DemoArgs) -> Status {
    let mut console = Console::new(args.json);
    run::run(args, &mut console).unwrap_or_else(|error| {
        complain(&format!("coloc: {error}"));
        Status::Failed
    })
}
