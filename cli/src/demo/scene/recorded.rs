//! Robots that really drove: a recording in MR.CLAM's format.

use std::path::Path;

use coloc_daemon::config::Preset;
use coloc_sim::mrclam::Recording;
use coloc_sim::{Scenario, World};

use super::Scene;
use crate::demo::DemoError;

/// The first `robots` of the recording in `folder`, or all.
pub(super) fn scene(folder: &Path, robots: Option<u16>) -> Result<Scene, DemoError> {
    let recording = Recording::load(folder).map_err(|error| DemoError::World(error.to_string()))?;
    let world = recording.resample();
    Ok(Scene {
        description: format!("recorded in {}", folder.display()),
        robots: robots.map_or(world.robots(), usize::from),
        world: Box::new(world),
        sensors: Scenario::paper(),
        wheels: Preset::Paper,
        untold: None,
    })
}
