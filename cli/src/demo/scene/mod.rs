//! What is played. A scene is one description of a world; the driver, the table and the picture are the same for all of them.
//!
//! A new scene is a function that fills a [`Scene`], and its name in [`SceneName`]. Something that can happen to a robot and that no
//! scene had before is a field here, and a line where the robots are fed or started.

mod meet;
mod recorded;

use clap::ValueEnum;
use coloc_daemon::config::Preset;
use coloc_sim::{Scenario, World};

use super::DemoError;
use crate::args::DemoArgs;

/// The scenes that are made up, as the command line calls them.
#[derive(Copy, Clone, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SceneName {
    /// Skidding robots turn and cross; who is seen is told where it is, but for one
    Meet,
}

/// A world, and all that is decided about it before it begins.
pub(crate) struct Scene {
    /// As a person would say it.
    pub(crate) description: String,
    /// Where everybody is at any time, and what their wheels say.
    pub(crate) world: Box<dyn World + Send>,
    /// Robots that take part, the first ones of the world.
    pub(crate) robots: usize,
    /// What sees them.
    pub(crate) sensors: Scenario,
    /// Whose wheels they have.
    pub(crate) wheels: Preset,
    /// The robot that is seen like the others, and that nobody tells what was seen: beside it one sees what help is worth.
    pub(crate) untold: Option<usize>,
}

impl Scene {
    /// The one that `args` ask for.
    pub(crate) fn new(args: &DemoArgs) -> Result<Self, DemoError> {
        match (&args.data, args.scene) {
            (Some(folder), _) => recorded::scene(folder, args.robots),
            (None, SceneName::Meet) => Ok(meet::scene(args)),
        }
    }
}
