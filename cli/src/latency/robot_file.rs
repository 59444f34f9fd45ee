//! The `robot.toml` of the robot whose daemon is measured, and the circle that it drives.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use coloc_drivers::can::BusSpec;
use coloc_drivers::encoder::OdometryConfig;
use serde::Serialize;

use super::PREFIX;
use super::args::{TriggerArg, WaitArg};
use super::placement::Placement;
use crate::result_file::WriteError;

/// The robot that is measured.
pub(crate) const ROBOT: &str = "robot1";
/// Distance of its wheels \[m\].
pub(crate) const TRACK_M: f64 = 0.258;
pub(crate) const METRES_PER_TICK: f64 = 1e-6;
/// Forward velocity \[m/s\] and turning rate \[rad/s\] of the circle.
const VELOCITY: [f64; 2] = [0.36, 0.2];

/// Where the robot is, `time_s` after it set out: `[x, y, φ]` in the common frame, whose origin is the circle's centre.
pub(crate) fn pose(time_s: f64) -> [f64; 3] {
    let [v, omega] = VELOCITY;
    let radius = v / omega;
    let phi = omega * time_s;
    let wrapped = phi - 2.0 * PI * ((phi - PI) / (2.0 * PI)).ceil();
    [radius * phi.sin(), -radius * phi.cos(), wrapped]
}

/// How far its left and its right wheel have come \[m\].
pub(crate) fn ways_m(time_s: f64) -> [f64; 2] {
    let [v, omega] = VELOCITY;
    [-1.0, 1.0].map(|side| (v + side * omega * TRACK_M / 2.0) * time_s)
}

/// Where robot 2, which stands at the origin, is in the body frame of the robot.
pub(crate) fn sight_of_the_origin(time_s: f64) -> [f64; 3] {
    let [_, _, phi] = pose(time_s);
    let [v, omega] = VELOCITY;
    [0.0, v / omega, -phi]
}

#[derive(Serialize)]
struct RobotFile<'a> {
    robot: Member,
    team: Vec<Member>,
    clock: Clock,
    tick: Tick,
    shm: Shm<'a>,
    initial: Initial,
    realtime: Realtime<'a>,
    telemetry: Telemetry,
    odometry: OdometryConfig,
}

#[derive(Serialize)]
struct Member {
    name: String,
    id: u16,
}

#[derive(Serialize)]
struct Clock {
    source: &'static str,
}

#[derive(Serialize)]
struct Tick {
    rate_hz: f64,
    trigger: TriggerArg,
    wait: WaitArg,
}

#[derive(Serialize)]
struct Shm<'a> {
    root: &'a Path,
    prefix: &'static str,
}

#[derive(Serialize)]
struct Initial {
    pose: [f64; 3],
}

#[derive(Serialize)]
struct Realtime<'a> {
    scheduler: &'static str,
    cpus: &'a [usize],
}

#[derive(Serialize)]
struct Telemetry {
    state_file: PathBuf,
}

/// What the file depends on.
pub(crate) struct Wanted<'a> {
    pub(crate) directory: &'a Path,
    pub(crate) root: &'a Path,
    pub(crate) bus: &'a BusSpec,
    pub(crate) placement: &'a Placement,
    pub(crate) rate_hz: f64,
    pub(crate) trigger: TriggerArg,
    pub(crate) neighbours: u16,
    pub(crate) wait: WaitArg,
}

/// Writes it.
pub(crate) fn write(wanted: &Wanted<'_>) -> Result<PathBuf, WriteError> {
    let path = wanted.directory.join("robot1.toml");
    let text =
        toml::to_string(&describe(wanted)).map_err(|error| WriteError::new(&path, &error))?;
    std::fs::write(&path, text).map_err(|error| WriteError::new(&path, &error))?;
    Ok(path)
}

fn describe<'a>(wanted: &Wanted<'a>) -> RobotFile<'a> {
    let member = |id: u16| Member {
        name: format!("robot{id}"),
        id,
    };
    RobotFile {
        robot: member(1),
        // Robot 2 is seen even where nobody speaks.
        team: (1..=wanted.neighbours.max(1) + 1).map(member).collect(),
        clock: Clock { source: "boottime" },
        tick: Tick {
            rate_hz: wanted.rate_hz,
            trigger: wanted.trigger,
            wait: wanted.wait,
        },
        shm: Shm {
            root: wanted.root,
            prefix: PREFIX,
        },
        initial: Initial { pose: pose(0.0) },
        realtime: Realtime {
            scheduler: match wanted.wait {
                WaitArg::Poll => "other",
                WaitArg::Sleep => "fifo",
            },
            cpus: &wanted.placement.daemon,
        },
        telemetry: Telemetry {
            state_file: wanted.directory.join("belief.toml"),
        },
        odometry: OdometryConfig::differential(
            wanted.bus.clone(),
            TRACK_M,
            METRES_PER_TICK,
            20.0, // Far above: frames may come close after one another when the machine was busy.
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wheels_the_pose_and_the_sighting_tell_the_same_story() {
        let (time_s, dt_s) = (40.0, 1e-6);
        let ([x0, y0, phi], [x1, y1, _]) = (pose(time_s), pose(time_s + dt_s));
        let (l0, l1) = (ways_m(time_s), ways_m(time_s + dt_s));
        let way = (l1[0] - l0[0] + l1[1] - l0[1]) / 2.0;
        assert!((x1 - x0 - way * phi.cos()).abs() < 1e-10);
        assert!((y1 - y0 - way * phi.sin()).abs() < 1e-10);
        let [dx, dy, _] = sight_of_the_origin(time_s);
        assert!((x0 + phi.cos() * dx - phi.sin() * dy).abs() < 1e-12);
        assert!((y0 + phi.sin() * dx + phi.cos() * dy).abs() < 1e-12);
    }
}
