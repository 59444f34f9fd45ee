//! The program, as a robot runs it: scans over shared memory, estimates of two robots, and what colocd makes of the sightings.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use coloc_daemon::collect::messages::sighting;
use coloc_daemon::collect::parts::{self, Landmarks};
use coloc_daemon::collect::sensors::Sensors;
use coloc_daemon::config::{Config, Robot as Named};
use coloc_sensors::Moment;
use coloc_shm_types::{
    BeliefState, Clock, DriverStatus, Estimate, Limits, Present, RelativePose, RobotName, Scan,
    Sender, Sighting, Space, boot,
};
use rustix::process::{Pid, Signal, kill_process};

const PATIENCE: Duration = Duration::from_secs(60);
const PREFIX: &str = "laser";
/// Where the other robot is, seen from the scanner.
const OTHER: [f64; 3] = [2.0, 0.5, 0.4];

/// A robot, its shared memory, and the programs that were started.
struct Robot {
    home: tempfile::TempDir,
    space: Space,
    programs: Vec<Child>,
}

impl Robot {
    fn new(laser: &str) -> Self {
        let home = tempfile::tempdir().unwrap();
        let root = home.path().join("shm");
        let space = Space::open(&root, PREFIX, "test").unwrap();
        let text = format!(
            "[robot]\nname = \"a\"\nid = 1\n[[team]]\nname = \"b\"\nid = 2\n[shm]\nroot = \"{}\"\nprefix = \"{PREFIX}\"\n\
             [laser]\nsource = 4\n{laser}",
            root.display()
        );
        std::fs::write(home.path().join("robot.toml"), text).unwrap();
        let is_round = laser.contains("cylinder");
        std::fs::write(home.path().join("room.log"), log(is_round)).unwrap();
        Self {
            home,
            space,
            programs: Vec::new(),
        }
    }

    fn command(&self, word: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_coloc-laser"));
        command.arg(word).arg(self.home.path().join("robot.toml"));
        command
    }

    fn start(&mut self, mut command: Command) {
        self.programs
            .push(command.stderr(Stdio::piped()).spawn().unwrap());
    }

    /// SIGTERM to all; status and words of the first.
    fn stop(mut self) -> Output {
        let mut ended = std::mem::take(&mut self.programs)
            .into_iter()
            .map(|program| {
                let pid = Pid::from_raw(program.id().cast_signed()).unwrap();
                let _ = kill_process(pid, Signal::TERM);
                program.wait_with_output().unwrap()
            });
        let first = ended.next().unwrap();
        ended.for_each(drop);
        first
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        for program in &mut self.programs {
            let _ = program.kill();
            let _ = program.wait();
        }
    }
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
fn until<T>(space: &Space, mut heard: impl FnMut() -> Option<T>) -> T {
    let ports = ["a", "b"].map(|name| {
        space
            .publisher::<Estimate>(&RobotName::new(name).unwrap())
            .unwrap()
    });
    let mut senders = [1, 2].map(|source| Sender::start(source, Clock::Boottime).unwrap());
    let poses = [
        [10.0, 5.0, 0.0],
        [10.0 + OTHER[0] + 0.2, 5.0 + OTHER[1] - 0.2, OTHER[2] + 0.1],
    ];
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        for ((port, sender), pose) in ports.iter().zip(&mut senders).zip(poses) {
            let _ = port.send(estimate(sender, pose));
        }
        if let Some(heard) = heard() {
            return heard;
        }
    }
    panic!("nothing was heard for {PATIENCE:?}");
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
    let mut robot = Robot::new(&format!(
        "{CYLINDER}[relative_pose]\nmount = [0.1, 0.0, 0.0]\n[sighting]\nheard = true\n"
    ));
    let name = RobotName::new("a").unwrap();
    let sightings = robot.space.subscriber::<Sighting>(&name).unwrap();
    let (run, mut play) = (robot.command("run"), robot.command("play"));
    robot.start(run);
    play.arg(robot.home.path().join("room.log"));
    robot.start(play);
    let seen = until(&robot.space, || {
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
    let config = Config::of(Named { name, id: 1 });
    let taken = parts::sighting(&seen, &limits(), &Sensors::of(&config), &Landmarks::of(&[]));
    taken.expect("colocd takes it");
    assert_eq!(robot.stop().status.code(), Some(0));
}

#[test]
fn a_log_that_is_played_onto_the_channel_becomes_sightings_that_colocd_takes() {
    let mut robot = Robot::new(RECTANGLE);
    let name = RobotName::new("a").unwrap();
    let sightings = robot.space.subscriber::<RelativePose>(&name).unwrap();
    let statuses = robot.space.subscriber::<DriverStatus>(&name).unwrap();
    let (run, mut play) = (robot.command("run"), robot.command("play"));
    robot.start(run);
    play.arg(robot.home.path().join("room.log"));
    robot.start(play);
    let patience = Duration::from_millis(20);
    let seen = until(&robot.space, || sightings.wait(patience).unwrap());
    assert_is_the_other(&seen);
    let is_it = |it: &DriverStatus| it.name() == "laser" && it.said > 0;
    let status = until(&robot.space, || {
        statuses.wait(patience).unwrap().filter(is_it)
    });
    assert!(
        status.whole >= status.said && status.broken == 0,
        "{status:?}"
    );
    let output = robot.stop();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("scans are looked through"), "{said}");
}

#[test]
fn what_is_played_is_never_of_the_future() {
    let mut robot = Robot::new(RECTANGLE);
    let scans = robot
        .space
        .subscriber::<Scan>(&RobotName::new("a").unwrap())
        .unwrap();
    let log = robot.home.path().join("gaps.log");
    let times = ["0.0", "0.3", "0.6", "3600.0", "3600.3", "1.0", "1.3"];
    let line = |time| {
        format!(
            "FLASER 180{} 0 0 0 0 0 0 {time} h {time}\n",
            " 5".repeat(180)
        )
    };
    std::fs::write(&log, times.map(line).concat()).unwrap();
    let mut play = robot.command("play");
    play.arg(log);
    robot.start(play);
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
    let mut robot = Robot::new(&format!("input = \"file:room.log\"\n{RECTANGLE}"));
    let sightings = robot
        .space
        .subscriber::<RelativePose>(&RobotName::new("a").unwrap())
        .unwrap();
    let run = robot.command("run");
    robot.start(run);
    let seen = until(&robot.space, || {
        sightings.wait(Duration::from_millis(20)).unwrap()
    });
    assert_is_the_other(&seen);
    assert_eq!(robot.stop().status.code(), Some(0));
}

#[test]
fn check_says_what_it_understood_and_what_is_unlikely() {
    let said = |laser: &str| {
        let robot = Robot::new(laser);
        let output = robot.command("check").arg("--strict").output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let problem = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said + &problem)
    };
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
    let (status, words) = said("look = []\n");
    assert!(
        status == Some(2) && words.contains("laser.look: say what"),
        "{words}"
    );
}
