//! The `robot.toml` of each of the demo's robots.

use std::path::{Path, PathBuf};

use coloc_drivers::can::BusSpec;
use coloc_drivers::encoder::OdometryConfig;
use serde::Serialize;

use super::PREFIX;
use super::world::Stage;
use crate::result_file::WriteError;

/// Distance of the wheels of the recorded robots \[m\].
pub(crate) const TRACK_M: f64 = 0.258;
/// So fine that counting whole ticks adds nothing to the noise (0.03 mm/s at 50 Hz).
pub(crate) const METRES_PER_TICK: f64 = 1e-6;
/// Far above any of the robots: two frames may come close after one another when the machine was busy.
const MAX_SPEED_MPS: f64 = 20.0;

/// The name of the robot with that number in the team.
pub(crate) fn name(id: usize) -> String {
    format!("robot{id}")
}

#[derive(Serialize)]
struct RobotFile<'a> {
    robot: Member,
    team: Vec<Member>,
    clock: Clock,
    shm: Shm<'a>,
    initial: Initial,
    telemetry: Telemetry,
    odometry: OdometryConfig,
}

#[derive(Serialize)]
struct Member {
    name: String,
    id: usize,
}

#[derive(Serialize)]
struct Clock {
    source: &'static str,
}

#[derive(Serialize)]
struct Shm<'a> {
    root: &'a Path,
    prefix: &'static str,
}

#[derive(Serialize)]
struct Initial {
    pose: [f64; 3],
    sigma: [f64; 3],
    resume: bool,
}

#[derive(Serialize)]
struct Telemetry {
    state_file: PathBuf,
}

/// Writes a file for each robot into `directory`, in the order of the robots.
pub(crate) fn write_all(
    directory: &Path,
    root: &Path,
    stage: &Stage,
    buses: &[BusSpec],
) -> Result<Vec<PathBuf>, WriteError> {
    let write = |(index, bus): (usize, &BusSpec)| {
        let path = directory.join(format!("{}.toml", name(index + 1)));
        let text = toml::to_string(&describe(index, directory, root, stage, bus))
            .map_err(|error| WriteError::new(&path, &error))?;
        std::fs::write(&path, text).map_err(|error| WriteError::new(&path, &error))?;
        Ok(path)
    };
    buses.iter().enumerate().map(write).collect()
}

fn describe<'a>(
    index: usize,
    directory: &Path,
    root: &'a Path,
    stage: &Stage,
    bus: &BusSpec,
) -> RobotFile<'a> {
    let member = |id| Member { name: name(id), id };
    let pose = stage.initial(index);
    RobotFile {
        robot: member(index + 1),
        team: (1..=stage.robots()).map(member).collect(),
        // All robots are on this machine: the clock that never steps.
        clock: Clock { source: "boottime" },
        shm: Shm {
            root,
            prefix: PREFIX,
        },
        // The paper starts everybody at the true pose.
        initial: Initial {
            pose: [pose.x, pose.y, pose.phi],
            sigma: [0.1, 0.1, 0.05],
            resume: true,
        },
        telemetry: Telemetry {
            state_file: directory.join(format!("{}.belief.toml", name(index + 1))),
        },
        odometry: OdometryConfig::differential(
            bus.clone(),
            TRACK_M,
            METRES_PER_TICK,
            MAX_SPEED_MPS,
        ),
    }
}
