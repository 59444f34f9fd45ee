//! What a person types.

use std::path::PathBuf;

use clap::Parser;

use crate::parts::Part;

/// In the short form.
const KILLS: u32 = 30;

/// Kills, stops, starves and robs a fleet of robots, and holds what lives to its promises.
///
/// With more kills than by default, with every call or with minutes it holds it to times, too.
#[derive(Parser)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Args {
    /// Where all chance comes from.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Kills at random moments; a sixth as many within start, and rounds of the other scenes in proportion.
    #[arg(long, default_value_t = KILLS)]
    pub(crate) kills: u32,
    /// Kill at every system call of start and end, instead of at as many as there are kills at random.
    #[arg(long)]
    pub(crate) every_call: bool,
    /// Begin again, with the next seed, until so many minutes have passed.
    #[arg(long, default_value_t = 0)]
    pub(crate) minutes: u64,
    /// These scenes alone.
    #[arg(long, value_name = "SCENE")]
    pub(crate) only: Vec<String>,
    /// This round alone, of each scene.
    #[arg(long)]
    pub(crate) round: Option<u32>,
    /// Another daemon than the one of this build.
    #[arg(long, value_name = "PROGRAM")]
    pub(crate) colocd: Option<PathBuf>,
    /// Leave a scene after so many failures.
    #[arg(long, default_value_t = 5)]
    pub(crate) failures: usize,
    /// Already in a mount namespace of its own.
    #[arg(long, hide = true)]
    pub(crate) alone: bool,
    #[command(subcommand)]
    pub(crate) part: Option<Part>,
}

impl Args {
    /// Whether times are bars: the short form is for machines that have other things to do.
    pub(crate) fn is_long(&self) -> bool {
        self.kills > KILLS || self.every_call || self.minutes > 0
    }
}
