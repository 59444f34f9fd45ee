//! What is played. A scene is one description of a world; the driver, the table and the picture are the same for all of them.
//!
//! A new scene is a function that fills a [`Scene`], and its name in [`SceneName`]. Something that can happen to a robot and that no
//! scene had before is a field here, and a line where the robots are fed or started.

mod camera;
mod laser;
mod leaders;
mod lost;
mod meet;
mod recorded;
mod rings;

use clap::ValueEnum;
use coloc_daemon::config::Preset;
use coloc_sim::laser::hall::Hall;
use coloc_sim::{Scenario, World};
use serde::Serialize;

use super::DemoError;
use super::bars::Expectation;
use super::lead::Lead;
use super::tale::Tale;
use crate::args::DemoArgs;
pub(crate) use camera::{Camera, Glance};
pub(crate) use laser::MOUNT;

/// The scenes that are made up, as the command line calls them.
#[derive(Copy, Clone, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SceneName {
    /// Skidding robots turn and cross; who is seen is told where it is, but for one
    Meet,
    /// Robots start from nowhere, are carried away, have receivers that jump: who notices, and when
    Lost,
    /// Robots find one another in the scans of their laser scanners
    Laser,
    /// Robots see range and bearing of those in front of their cameras, and nothing else
    Camera,
}

/// By what robots see one another.
pub(crate) enum Eyes {
    /// They are given whole poses.
    Poses,
    /// They have scanners in this hall, and a coloc-laser each.
    Scans(Hall),
    /// They are given range and bearing.
    Camera(Camera),
}

/// What a robot has to go by, besides its wheels.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Help {
    /// Fixes, and what others tell.
    Receiver,
    /// Fixes and a compass.
    Leader,
    /// What leaders say.
    Child,
    /// What those tell who see it.
    Told,
    /// It is seen, and nobody tells it.
    Nobody,
}

impl Help {
    /// Whether what others say is what it has to go by.
    pub(crate) fn is_from_others(self) -> bool {
        matches!(self, Self::Told | Self::Child)
    }

    /// By what or whom, in a word.
    pub(crate) fn by(self) -> &'static str {
        match self {
            Self::Receiver => "fixes",
            Self::Leader => "itself",
            Self::Child => "leader",
            Self::Told => "others",
            Self::Nobody => "nobody",
        }
    }

    /// As a person would say it of the robot.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Receiver => "has a receiver",
            Self::Leader => "leads",
            Self::Child => "carried by leaders",
            Self::Told => "told by who sees it",
            Self::Nobody => "seen, but told nothing",
        }
    }
}

/// One robot's part.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Part {
    pub(crate) help: Help,
    /// Nothing where it is the tale that is judged.
    pub(crate) expected: Option<Expectation>,
    pub(crate) tale: Option<Tale>,
}

/// A world, and all that is decided about it before it begins.
pub(crate) struct Scene {
    /// As a person would say it.
    pub(crate) description: String,
    /// Where everybody is at any time, and what their wheels say.
    pub(crate) world: Box<dyn World + Send>,
    /// Those who play, the first robots of the world.
    pub(crate) parts: Vec<Part>,
    /// What sees them.
    pub(crate) sensors: Scenario,
    /// How.
    pub(crate) eyes: Eyes,
    /// Whose wheels they have.
    pub(crate) wheels: Preset,
    /// Who leads, if anybody does.
    pub(crate) lead: Option<Lead>,
}

impl SceneName {
    /// As long as it takes to tell \[s\].
    pub(crate) fn length_s(self) -> f64 {
        match self {
            Self::Meet | Self::Laser | Self::Camera => 30.0,
            Self::Lost => 40.0,
        }
    }
}

impl Scene {
    /// The one that `args` ask for.
    pub(crate) fn new(args: &DemoArgs) -> Result<Self, DemoError> {
        match (&args.data, args.played()) {
            (Some(folder), _) => recorded::scene(folder, args),
            (None, _) if args.leaders.is_some() => leaders::scene(args),
            (None, SceneName::Meet) => Ok(meet::scene(args)),
            (None, SceneName::Lost) => lost::scene(args),
            (None, SceneName::Laser) => laser::scene(args),
            (None, SceneName::Camera) => camera::scene(args),
        }
    }
}
