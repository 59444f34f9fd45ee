//! A recorded car's CAN bus, played at its real speed by `canplayer`: the daemon's speed against the car's reference.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};

use coloc_daemon::config::{self, Config, Shm};
use coloc_drivers::can::{Filter, Id, StandardId};
use coloc_drivers::encoder::{OdometryConfig, Quantity, WheelConfig, WheelsConfig};
use coloc_shm_types::{RobotName, Timing};

use super::robot::{NAME, PREFIX, Robot, ordinary};
use super::support::Interface;

const WHEEL_SPEEDS: u16 = 0x0AA;
/// As the log has it: the interface that is played, identifier, mark.
const IN_THE_LOG: &str = " can0 0AA#";
/// On a machine that is busy elsewhere some of the 3,000 are late, and read together.
const LEAST_ESTIMATES: usize = 1000;

/// `COLOC_DATA`, or `../shared/data` from here or any directory above.
fn recording() -> Option<PathBuf> {
    let given = std::env::var_os("COLOC_DATA").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|directory| directory.join("shared/data"));
    let mut found = given
        .into_iter()
        .chain(above)
        .map(|data| data.join("rav4_can"));
    found.find(|data| data.is_dir())
}

fn configuration(data: &Path, bus: &str, root: &Path) -> Config {
    let wheel = |name| WheelConfig {
        quantity: Quantity::KilometresPerHour,
        ..WheelConfig::new("WHEEL_SPEEDS", &format!("WHEEL_SPEED_{name}"))
    };
    let wheels = WheelsConfig {
        track_m: 1.56,
        turning_scale: 1.0,
        left: wheel("RL"),
        right: wheel("RR"),
    };
    let odometry = OdometryConfig {
        dbc: Some(data.join("toyota_2017.dbc")),
        wheels: Some(wheels),
        ..OdometryConfig::differential(bus.parse().unwrap(), 1.0, 1.0, 70.0)
    };
    Config {
        shm: Shm {
            root: root.into(),
            prefix: PREFIX.into(),
            ..Shm::default()
        },
        odometry: Some(odometry),
        realtime: ordinary(),
        ..Config::of(config::Robot {
            name: RobotName::new(NAME).unwrap(),
            id: 1,
        })
    }
}

fn play(data: &Path) -> Child {
    let player = Command::new("sh")
        .args(["-c", "zcat \"$0\" | canplayer vcan0=can0 vcan1=can1"])
        .arg(data.join("candump.log.gz"))
        .spawn();
    player.expect("a shell; canplayer is of the package can-utils")
}

/// When each `WHEEL_SPEEDS` frame of the log was recorded \[s\].
fn recorded_s(data: &Path) -> Vec<f64> {
    let log = unpacked(&data.join("candump.log.gz"));
    let wheels = log.lines().filter(|line| line.contains(IN_THE_LOG));
    wheels
        .map(|line| line[1..line.find(')').unwrap()].parse().unwrap())
        .collect()
}

fn unpacked(path: &Path) -> String {
    let unpacked = Command::new("zcat").arg(path).output().unwrap();
    String::from_utf8(unpacked.stdout).unwrap()
}

/// The reference's times \[s\] and speeds \[m/s\].
fn reference(data: &Path) -> Vec<(f64, f64)> {
    let text = unpacked(&data.join("pose.csv.gz"));
    let row = |line: &str| {
        let row: Vec<f64> = line
            .split(',')
            .map(|number| number.parse().unwrap())
            .collect();
        (row[0], row[8].hypot(row[9]).hypot(row[10]))
    };
    text.lines().skip(1).map(row).collect()
}

/// The speed at `time_s`, between the two entries around it.
fn speed_at(reference: &[(f64, f64)], time_s: f64) -> Option<f64> {
    let after = reference.partition_point(|entry| entry.0 <= time_s);
    let ((t0, v0), (t1, v1)) = (
        *reference.get(after.checked_sub(1)?)?,
        *reference.get(after)?,
    );
    Some(v0 + (v1 - v0) * (time_s - t0) / (t1 - t0))
}

#[test]
fn a_recorded_car_at_real_speed_has_the_speed_of_its_reference() {
    let Some(data) = recording() else {
        eprintln!("SKIPPED: no recorded car; set COLOC_DATA to the directory that holds rav4_can");
        return;
    };
    let interface = Interface::new("vcan0");
    let robot = Robot::configured(|root| configuration(&data, &interface.spec(), root));
    let id = Id::from(StandardId::new(WHEEL_SPEEDS).unwrap());
    let mut witness = interface.bus(Filter::ids([id]));
    let mut player = play(&data);
    let (mut speeds_mps, mut timings, mut stamps_ns) = (BTreeMap::new(), Vec::new(), Vec::new());
    let mut look = || {
        witness.receive(&mut |frame| stamps_ns.push(frame.stamp_ns));
        let estimates = robot.estimates();
        speeds_mps.extend(estimates.map(|estimate| (estimate.tick, estimate.velocity[0])));
        timings.extend(robot.timings());
        std::thread::sleep(std::time::Duration::from_millis(50));
    };
    while player.try_wait().unwrap().is_none() {
        look();
    }
    look();

    // Which frame, not when it was played, says what the car did: a busy machine plays late.
    let (recorded_s, reference) = (recorded_s(&data), reference(&data));
    assert_eq!(stamps_ns.len(), recorded_s.len(), "every frame was seen");
    let error = |timing: &Timing| {
        let frame = stamps_ns.binary_search(&timing.frame_stamp_ns).ok()?;
        let speed_mps = speed_at(&reference, recorded_s[frame])?;
        Some(speeds_mps.get(&timing.tick)? / speed_mps - 1.0)
    };
    let mut errors: Vec<f64> = timings.iter().filter_map(error).collect();
    errors.sort_by(f64::total_cmp);
    let count = errors.len();
    assert!(count >= LEAST_ESTIMATES, "{count} estimates");
    let [low, median, high] =
        [count / 100, count / 2, count - 1 - count / 100].map(|place| errors[place]);
    eprintln!(
        "speed against the reference: median {:+.2} %, 1 % below {:+.2} %, 1 % above {:+.2} %",
        100.0 * median,
        100.0 * low,
        100.0 * high
    );
    // These wheels are 0.8 % short of the reference.
    assert!((median + 0.008).abs() < 0.004, "median {median}");
    assert!(
        low > -0.03 && high < 0.03,
        "1 % below {low}, 1 % above {high}"
    );
    robot.end();
}
