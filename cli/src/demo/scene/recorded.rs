//! Robots that really drove: a recording in MR.CLAM's format.

use std::path::Path;

use coloc_daemon::config::Preset;
use coloc_sim::mrclam::Recording;
use coloc_sim::{Scenario, World};

use super::{Eyes, Help, Part, Scene, leaders};
use crate::args::DemoArgs;
use crate::demo::DemoError;
use crate::demo::bars::Expectation;
use crate::demo::lead::Lead;

/// Of the time in which robots are told something.
const TOLD: f64 = 0.2;

/// Everybody sees nearly everybody. Of the paper's worlds, of 6, 10, 30 and 120 s, the worst came to this (errors: time mean):
/// robots that see nobody for a while, in teams of two to four, 0.17 m and 0.21 rad, 96 % inside; one alone, to which fixes say next
/// to nothing about its heading at 0.1 m/s, 0.05 m and 0.24 rad, 93 % inside; in larger teams 0.09 m and 0.05 rad, 99 % inside.
fn expected(robots: usize) -> Expectation {
    let (whose, error, inside) = match robots {
        0..=1 => ("a robot alone", [0.10, 0.10, 0.30], 0.90),
        2..=4 => ("few robots", [0.20, 0.20, 0.25], 0.95),
        _ => ("a team", [0.10, 0.10, 0.10], 0.99),
    };
    Expectation {
        whose,
        error: Some(error),
        inside,
        told: TOLD,
    }
}

/// The robots of the recording in `folder`, or the first ones of them.
pub(super) fn scene(folder: &Path, args: &DemoArgs) -> Result<Scene, DemoError> {
    let recording = Recording::load(folder).map_err(|error| DemoError::World(error.to_string()))?;
    let world = recording.resample();
    let robots = args.robots.map_or(world.robots(), usize::from);
    let lead = Lead::new(args, robots)?;
    let paper = Scenario::paper();
    let range_m = paper.sightings.range_m;
    let sensors = lead
        .as_ref()
        .map_or(paper, |lead| leaders::sensors(lead, range_m));
    let part = |robot| Part {
        help: if sensors.fixes.robots.contains(&robot) {
            Help::Receiver
        } else {
            Help::Told
        },
        expected: Some(expected(robots)),
        tale: None,
    };
    Ok(Scene {
        description: format!("recorded in {}", folder.display()),
        parts: lead
            .as_ref()
            .map_or_else(|| (0..robots).map(part).collect(), Lead::parts),
        world: Box::new(world),
        sensors,
        eyes: Eyes::Poses,
        // The paper's make a robot that hardly moves surer than it may be, and a leader must not be (docs/leaders.md).
        wheels: if lead.is_some() {
            Preset::Mrclam
        } else {
            Preset::Paper
        },
        lead,
    })
}
