//! The `robot.toml` of each of the demo's robots.

use std::path::{Path, PathBuf};

use coloc_daemon::config::{
    Assist, Clock, ClockSource, Config, Initial, InitialPose, Position, RelativePose, Shm,
    Sighting, Telemetry,
};
use coloc_drivers::can::BusSpec;
use coloc_drivers::encoder::OdometryConfig;
use coloc_laser::section::{Laser, LookSection, Shape};
use coloc_scan::Look;
use coloc_sim::laser::hall::Hall;

use super::PREFIX;
use super::lead::Lead;
use super::links::{LinkSection, Plan};
use super::scene::{Eyes, MOUNT};
use super::tale::Tale;
use super::world::Stage;
use crate::result_file::WriteError;
use crate::robot_file::{robot, team, write, write_below, write_with};

/// Distance of the wheels of the recorded robots \[m\].
pub(crate) const TRACK_M: f64 = 0.258;
/// So fine that counting whole ticks adds nothing to the noise (0.03 mm/s at 50 Hz).
pub(crate) const METRES_PER_TICK: f64 = 1e-6;
/// Far above any of the robots: two frames may come close after one another when the machine was busy.
const MAX_SPEED_MPS: f64 = 20.0;

/// The directory of the team, in the folder of the configurations.
pub(crate) const TEAM: &str = "team";

/// The name of the robot with that number in the team.
pub(crate) fn name(id: usize) -> String {
    format!("robot{id}")
}

/// Where the robot with that index records, in the folder of its configuration.
pub(super) fn recording(directory: &Path, index: usize) -> PathBuf {
    directory.join(format!("{}.jsonl", name(index + 1)))
}

/// Writes a file for each robot into `directory`, in the order of the robots.
pub(crate) fn write_all(
    directory: &Path,
    roots: &[PathBuf],
    stage: &Stage,
    buses: &[BusSpec],
    plan: Option<&Plan>,
) -> Result<Vec<PathBuf>, WriteError> {
    let write = |(index, (bus, root)): (usize, (&BusSpec, &PathBuf))| {
        let path = directory.join(format!("{}.toml", name(index + 1)));
        let mut config = describe(index, directory, root, stage, bus);
        if let Some(plan) = plan {
            if let Ok(config) = &mut config {
                config.clock.source = ClockSource::Realtime;
                config.telemetry.record = recording(directory, index);
            }
            let section = plan.section(index, &link_directory(directory, index));
            write_below(&path, config, LinkSection::NAME, &section)?;
            return Ok(path);
        }
        match stage.eyes() {
            Eyes::Scans(hall) => write_with(&path, config, &laser(hall))?,
            Eyes::Poses | Eyes::Camera(_) => write(&path, config)?,
        }
        Ok(path)
    };
    buses.iter().zip(roots).enumerate().map(write).collect()
}

/// The own directory of a robot's link, with its roster, in that of the team.
pub(crate) fn link_directory(directory: &Path, index: usize) -> PathBuf {
    directory.join(TEAM).join(name(index + 1))
}

fn describe(
    index: usize,
    directory: &Path,
    root: &Path,
    stage: &Stage,
    bus: &BusSpec,
) -> Result<Config, String> {
    let odometry =
        OdometryConfig::differential(bus.clone(), TRACK_M, METRES_PER_TICK, MAX_SPEED_MPS);
    Ok(Config {
        // All robots are on this machine: the clock that never steps.
        clock: Clock {
            source: ClockSource::Boottime,
        },
        shm: Shm {
            root: root.into(),
            prefix: PREFIX.into(),
            ..Shm::default()
        },
        telemetry: Telemetry {
            state_file: directory.join(format!("{}.belief.toml", name(index + 1))),
            record: stage
                .lead()
                .map_or_else(PathBuf::new, |_| recording(directory, index)),
            ..Telemetry::default()
        },
        odometry: Some(odometry),
        ..believed(stage, index)?
    })
}

/// `[laser]`: how a scanner in that hall errs, and what it looks for.
fn laser(hall: &Hall) -> Laser {
    let look = |(robot, look): (u16, &Look)| {
        let mut section = LookSection {
            robots: vec![robot],
            ..LookSection::default()
        };
        match look {
            Look::Rectangle {
                length_m,
                width_m,
                centre_m,
            } => {
                section.shape = Shape::Rectangle;
                (section.length_m, section.width_m) = (*length_m, *width_m);
                section.centre_m = *centre_m;
            }
            Look::Cylinder { radius_m } => section.radius_m = *radius_m,
            Look::Marks(pattern) => {
                section.shape = Shape::Marks;
                section.marks = pattern.marks().to_vec();
                section.mark_radius_m = pattern.radius_m();
            }
        }
        section
    };
    Laser::of((1..).zip(hall.looks()).map(look).collect())
}

/// What the robot believes before it hears anything.
pub(super) fn believed(stage: &Stage, index: usize) -> Result<Config, String> {
    let number = |count: usize| u16::try_from(count).map_err(|error| error.to_string());
    let (pose, tale) = (stage.initial(index), stage.tale(index));
    // A leader finds itself, also when it is started again elsewhere.
    let leads = stage.leads(index);
    let knows = !leads && tale.is_none_or(Tale::knows_its_start);
    Ok(Config {
        team: team(number(stage.robots())?)?,
        // The paper starts everybody at the true pose.
        initial: Initial {
            pose: Some(if knows {
                InitialPose::Given([pose.x, pose.y, pose.phi])
            } else {
                InitialPose::Unknown
            }),
            sigma: [0.1, 0.1, 0.05],
            resume: !leads,
            ..Initial::default()
        },
        position: Position {
            receivers: tale.map_or(u16::from(leads), Tale::receivers),
            trust_jump: tale.map(Tale::trust_jump).unwrap_or_default(),
            ..Position::default()
        },
        sighting: Sighting {
            heard: !matches!(stage.eyes(), Eyes::Poses),
            ..Sighting::default()
        },
        relative_pose: RelativePose {
            mount: match stage.eyes() {
                Eyes::Scans(_) => MOUNT,
                Eyes::Poses | Eyes::Camera(_) => [0.0; 3],
            },
            ..RelativePose::default()
        },
        assist: stage
            .lead()
            .map_or_else(|| Ok(Assist::default()), Lead::section)?,
        // What the worlds' wheels are made with.
        motion: stage.motion(),
        ..robot(number(index + 1)?)?
    })
}
