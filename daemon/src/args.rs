//! The command line of `colocd`.

use std::path::PathBuf;

use clap::{Parser, Subcommand};

/// Tells a wheeled robot where it is: cooperative localization over shared memory.
#[derive(Debug, Parser)]
#[command(name = "colocd", version, arg_required_else_help = true)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Localize one robot until SIGINT or SIGTERM.
    Run {
        /// The robot's configuration.
        config: PathBuf,
    },
    /// Read a configuration, say what it means and what is unlikely about it, open nothing.
    Check {
        /// The robot's configuration.
        config: PathBuf,
        /// End with status 1 if anything is unlikely.
        #[arg(long)]
        strict: bool,
    },
}
