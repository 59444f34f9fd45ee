//! The program, as a robot runs it: scans over shared memory, estimates of two robots, and what colocd makes of the sightings.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::time::Duration;

use coloc_daemon::collect::messages::sighting;
use coloc_daemon::collect::parts::{self, Landmarks};
use coloc_daemon::collect::sensors::Sensors;
use coloc_daemon::config::{Config, Robot as Named};
use coloc_rig::{PATIENCE, Rig};
use coloc_sensors::Moment;
use coloc_shm_types::{
    BeliefState, Clock, DriverStatus, Estimate, Limits, Present, RelativePose, RobotName, Scan,
    Sender, Sighting, boot,
};

/// From one word of both robots to the next.
const TICK: Duration = Duration::from_millis(10);
/// Where the other robot is, seen from the scanner.
const OTHER: [f64; 3] = [2.0, 0.5, 0.4];

/// A robot with another one in its team, and logs of its scanner.
fn robot(laser: &str) -> Rig {
    let rig = Rig::new("laser", env!("CARGO_BIN_EXE_coloc-laser"));
    rig.configure("a", &["a", "b"], &format!("[laser]\nsource = 4\n{laser}"));
    let is_round = laser.contains("cylinder");
    std::fs::write(rig.path("room.log"), log(is_round)).unwrap();
    rig
}

/// Starts to play a log.
fn play(robot: &mut Rig, log: &str) {
    let mut play = robot.command("play", "a");
    play.arg(robot.path(log));
    robot.start(play);
}

/// Status and words of the first program that was started.
fn stop(robot: Rig) -> (Option<i32>, String) {
    let first = robot.stop().swap_remove(0);
    (
        first.status.code(),
        String::from_utf8(first.stderr).unwrap(),
    )
}

const RECTANGLE: &str = "[[laser.look]]\nshape = \"rectangle\"\nlength_m = 0.7\nwidth_m = 0.5\n";

const CYLINDER: &str = "[[laser.look]]\nshape = \"cylinder\"\nradius_m = 0.25\n";

/// A hall of 5 m with one rectangle or cylinder in it, over and over, ten times a second.
fn log(is_round: bool) -> String {
    let mut ranges = String::new();
    for place in 0..180 {
        let (sin, cos) = (-0.5 * PI + f64::from(place) * PI / 180.0).sin_cos();
        if is_round {
            let (along, aside) = (
                OTHER[0] * cos + OTHER[1] * sin,
                OTHER[1] * cos - OTHER[0] * sin,
            );
            let inside = 0.0625 - aside * aside;
            let range = if inside > 0.0 {
                along - inside.sqrt()
            } else {
                5.0
            };
            write!(ranges, " {range:.3}").unwrap();
            continue;
        }
        let (s, c) = OTHER[2].sin_cos();
        let from = [-c * OTHER[0] - s * OTHER[1], s * OTHER[0] - c * OTHER[1]];
        let way = [c * cos + s * sin, c * sin - s * cos];
        let spans = [(0, 0.35), (1, 0.25)].map(|(it, half)| {
            let ends = [-half, half].map(|end: f64| (end - from[it]) / way[it]);
            [ends[0].min(ends[1]), ends[0].max(ends[1])]
        });
        let (enters, leaves) = (spans[0][0].max(spans[1][0]), spans[0][1].min(spans[1][1]));
        let range = if enters > 0.0 && enters < leaves {
            enters
        } else {
            5.0
        };
        write!(ranges, " {range:.3}").unwrap();
    }
    let line = |scan: u32| {
        format!(
            "FLASER 180{ranges} 0 0 0 0 0 0 {0:.1} h {0:.1}\n",
            f64::from(scan) * 0.1
        )
    };
    format!(
        "PARAM x 1\n{}FLASER cut\n",
        (0..1200).map(line).collect::<String>()
    )
}

/// What a robot's colocd would say.
fn estimate(sender: &mut Sender, pose: [f64; 3]) -> Estimate {
    let now_ns = Moment::now().boottime_ns;
    Estimate {
        header: sender.header(now_ns),
        boot_ns: now_ns,
        pose,
        independent: [0.04, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.0, 0.01],
        state: BeliefState::Ok as u8,
        ..Estimate::default()
    }
}

/// Lets both robots speak until `heard` hears what it wants.
fn until<T>(robot: &Rig, mut heard: impl FnMut() -> Option<T>) -> T {
    let ports = ["a", "b"].map(|name| robot.publisher::<Estimate>(name));
    let mut senders = [1, 2].map(|source| Sender::start(source, Clock::Boottime).unwrap());
    let poses = [
        [10.0, 5.0, 0.0],
        [10.0 + OTHER[0] + 0.2, 5.0 + OTHER[1] - 0.2, OTHER[2] + 0.1],
    ];
    let speak = |senders: &mut [Sender; 2]| {
        for ((port, sender), pose) in ports.iter().zip(senders).zip(poses) {
            let _ = port.send(estimate(sender, pose));
        }
    };
    coloc_rig::until(&mut senders, TICK, speak, |_| heard())
}

fn assert_is_the_other(seen: &RelativePose) {
    assert_eq!((seen.observed, seen.header.source), (2, 4));
    let off = [0, 1, 2].map(|it| (seen.pose[it] - OTHER[it]).abs());
    assert!(off[0] < 0.03 && off[1] < 0.03 && off[2] < 0.05, "{seen:?}");
    sighting(seen, &limits()).expect("colocd takes it");
}

/// Those of a robot that hears this.
fn limits() -> Limits<'static> {
    Limits {
        now: Present::only(Clock::Boottime, Moment::now().boottime_ns),
        boot: boot(),
        history_ns: 60_000_000_000,
        future_tolerance_ns: 1_000_000_000,
        own: 1,
        robots: &[1, 2],
    }
}

#[test]
fn a_cylinder_becomes_a_range_and_a_bearing_that_colocd_takes() {
    let mut robot = robot(&format!(
        "{CYLINDER}[relative_pose]\nmount = [0.1, 0.0, 0.0]\n[sighting]\nheard = true\n"
    ));
    let sightings = robot.subscriber::<Sighting>("a");
    robot.start(robot.command("run", "a"));
    play(&mut robot, "room.log");
    let seen = until(&robot, || {
        sightings.wait(Duration::from_millis(20)).unwrap()
    });
    assert_eq!((seen.observed, seen.header.source), (2, 4));
    assert_eq!(
        (seen.who, seen.has),
        (Sighting::ROBOT, Sighting::RANGE | Sighting::BEARING)
    );
    let off = [
        seen.range - OTHER[0].hypot(OTHER[1]),
        seen.bearing - OTHER[1].atan2(OTHER[0]),
    ];
    assert!(off[0].abs() < 0.03 && off[1].abs() < 0.02, "{seen:?}");
    assert_eq!(
        seen.mount.map(f64::to_bits),
        [0.1, 0.0, 0.0].map(f64::to_bits)
    );
    assert!(seen.slow[0] > 0.0 && seen.slow[2] > 0.0);
    let name = RobotName::new("a").unwrap();
    let config = Config::of(Named { name, id: 1 });
    let taken = parts::sighting(&seen, &limits(), &Sensors::of(&config), &Landmarks::of(&[]));
    taken.expect("colocd takes it");
    assert_eq!(stop(robot).0, Some(0));
}

#[test]
fn a_log_that_is_played_onto_the_channel_becomes_sightings_that_colocd_takes() {
    let mut robot = robot(RECTANGLE);
    let sightings = robot.subscriber::<RelativePose>("a");
    let statuses = robot.subscriber::<DriverStatus>("a");
    robot.start(robot.command("run", "a"));
    play(&mut robot, "room.log");
    let patience = Duration::from_millis(20);
    let seen = until(&robot, || sightings.wait(patience).unwrap());
    assert_is_the_other(&seen);
    let is_it = |it: &DriverStatus| it.name() == "laser" && it.said > 0;
    let status = until(&robot, || statuses.wait(patience).unwrap().filter(is_it));
    assert!(
        status.whole >= status.said && status.broken == 0,
        "{status:?}"
    );
    let (status, said) = stop(robot);
    assert_eq!(status, Some(0), "{said}");
    assert!(said.contains("scans are looked through"), "{said}");
}

#[test]
fn what_is_played_is_never_of_the_future() {
    let mut robot = robot(RECTANGLE);
    let scans = robot.subscriber::<Scan>("a");
    let times = ["0.0", "0.3", "0.6", "3600.0", "3600.3", "1.0", "1.3"];
    let line = |time| {
        format!(
            "FLASER 180{} 0 0 0 0 0 0 {time} h {time}\n",
            " 5".repeat(180)
        )
    };
    std::fs::write(robot.path("gaps.log"), times.map(line).concat()).unwrap();
    play(&mut robot, "gaps.log");
    let mut last_ns = 0;
    for time in times {
        let scan = scans.wait(PATIENCE).unwrap().expect(time);
        let now_ns = Moment::now().boottime_ns;
        let stamp_ns = scan.header.stamp_ns;
        assert!(stamp_ns > last_ns && stamp_ns <= now_ns, "{time} s");
        last_ns = stamp_ns;
    }
}

#[test]
fn a_log_can_be_the_input_itself() {
    let mut robot = robot(&format!("input = \"file:room.log\"\n{RECTANGLE}"));
    let sightings = robot.subscriber::<RelativePose>("a");
    robot.start(robot.command("run", "a"));
    let seen = until(&robot, || {
        sightings.wait(Duration::from_millis(20)).unwrap()
    });
    assert_is_the_other(&seen);
    assert_eq!(stop(robot).0, Some(0));
}

#[test]
fn check_says_what_it_understood_and_what_is_unlikely() {
    let said = |laser: &str| robot(laser).said("check", "a", &["--strict"]);
    let (status, words) = said(RECTANGLE);
    assert_eq!(status, Some(0), "{words}");
    assert!(words.contains("b: a rectangle, 0.7 m long"), "{words}");
    let (status, words) = said(CYLINDER);
    assert!(
        status == Some(1) && words.contains("write [sighting] heard = true"),
        "{words}"
    );
    let (status, words) = said(&format!("{CYLINDER}[sighting]\nheard = true\n"));
    assert_eq!(status, Some(0), "{words}");
    let (status, words) = said(&format!("{RECTANGLE}robots = [2, 7]\n"));
    assert!(
        status == Some(1) && words.contains("is of robot 7, which is no other robot of [[team]]"),
        "{words}"
    );
    let (status, words) = said("look = []\n");
    assert!(
        status == Some(2) && words.contains("laser.look: say what"),
        "{words}"
    );
}

#[test]
fn there_is_one_of_it_and_one_player() {
    robot(RECTANGLE).assert_alone("run", "a");
    let mut robot = robot(RECTANGLE);
    let scans = robot.subscriber::<Scan>("a");
    play(&mut robot, "room.log");
    assert!(scans.wait(PATIENCE).unwrap().is_some());
    let log = robot.path("room.log");
    let (status, said) = robot.said("play", "a", &[log.to_str().unwrap()]);
    assert!(
        status == Some(5) && said.contains("already runs as process"),
        "{said}"
    );
}
