//! The `robot.toml` of the robot whose daemon is measured, and the circle that it drives.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use coloc_daemon::config::{
    Clock, ClockSource, Config, History, Initial, InitialPose, Realtime, Scheduler, Shm, Telemetry,
    Tick,
};
use coloc_drivers::can::BusSpec;
use coloc_drivers::encoder::OdometryConfig;

use super::args::{TriggerArg, WaitArg};
use super::place::PREFIX;
use super::placement::Placement;
use crate::result_file::WriteError;
use crate::robot_file::{self, robot, team};

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

/// What the file depends on.
pub(crate) struct Wanted<'a> {
    pub(crate) directory: &'a Path,
    pub(crate) root: &'a Path,
    /// One, or one for each wheel.
    pub(crate) buses: &'a [BusSpec],
    pub(crate) placement: &'a Placement,
    pub(crate) rate_hz: f64,
    pub(crate) trigger: TriggerArg,
    pub(crate) neighbours: u16,
    pub(crate) wait: WaitArg,
}

/// Writes it.
pub(crate) fn write(wanted: &Wanted<'_>) -> Result<PathBuf, WriteError> {
    let path = wanted.directory.join("robot1.toml");
    robot_file::write(&path, describe(wanted))?;
    Ok(path)
}

fn describe(wanted: &Wanted<'_>) -> Result<Config, String> {
    Ok(Config {
        // Robot 2 is seen even where nobody speaks.
        team: team(wanted.neighbours.max(1) + 1)?,
        clock: Clock {
            source: ClockSource::Boottime,
        },
        tick: Tick {
            rate_hz: wanted.rate_hz,
            trigger: wanted.trigger.setting(),
            wait: wanted.wait.setting(),
        },
        shm: Shm {
            root: wanted.root.into(),
            prefix: PREFIX.into(),
            ..Shm::default()
        },
        initial: Initial {
            pose: Some(InitialPose::Given(pose(0.0))),
            ..Initial::default()
        },
        history: History::for_rate(wanted.rate_hz),
        realtime: Realtime {
            scheduler: match wanted.wait {
                WaitArg::Poll => Scheduler::Other,
                WaitArg::Sleep => Scheduler::Fifo,
            },
            cpus: wanted.placement.daemon.clone(),
            ..Realtime::default()
        },
        telemetry: Telemetry {
            state_file: wanted.directory.join("belief.toml"),
            ..Telemetry::default()
        },
        odometry: Some(odometry(wanted.buses)?),
        ..robot(1)?
    })
}

fn odometry(buses: &[BusSpec]) -> Result<OdometryConfig, String> {
    // Far above: frames may come close after one another when the machine was busy.
    let max_speed_mps = 20.0;
    let [first, others @ ..] = buses else {
        return Err("there is no bus".into());
    };
    let mut odometry =
        OdometryConfig::differential(first.clone(), TRACK_M, METRES_PER_TICK, max_speed_mps);
    odometry.buses.extend_from_slice(others);
    if let (Some(wheels), Ok(last)) = (&mut odometry.wheels, u8::try_from(others.len())) {
        wheels.right.bus = last;
    }
    Ok(odometry)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_daemon_takes_the_file_at_every_rate() {
        let directory = tempfile::tempdir().unwrap();
        let root = directory.path().join("shm");
        let both: Vec<BusSpec> = ["local:/tmp/bus", "local:/tmp/other"]
            .map(|bus| bus.parse().unwrap())
            .into();
        for rate_hz in [1.0, 50.0, 200.0, 1000.0] {
            for (wait, buses) in [(WaitArg::Poll, &both[..1]), (WaitArg::Sleep, &both)] {
                let wanted = Wanted {
                    directory: directory.path(),
                    root: &root,
                    buses,
                    placement: &Placement::choose(),
                    rate_hz,
                    trigger: TriggerArg::Encoder,
                    neighbours: 4,
                    wait,
                };
                let path = write(&wanted).unwrap();
                let config = Config::load(&path).unwrap();
                assert_eq!(config, describe(&wanted).unwrap());
            }
        }
    }

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
