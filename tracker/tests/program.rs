//! The program, as two robots run it: what they see of one another in part and what their daemons say of their wheels, over shared memory.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use coloc_sensors::Moment;
use coloc_shm_types::{
    Clock, DriverStatus, Estimate, Header, Health, Increment, Limits, Message, Present, Publisher,
    RobotName, Sender, Sighting, Space, Subscriber, Tracked, boot,
};
use rustix::process::{Pid, Signal, kill_process};

const PATIENCE: Duration = Duration::from_secs(60);
const PREFIX: &str = "track";
const ROBOTS: [&str; 2] = ["a", "b"];
/// From one word of a daemon to the next.
const TICK: Duration = Duration::from_millis(20);
/// A sighting every so many of them.
const EVERY: u32 = 5;
/// Of what is seen \[m², rad²\].
const WHITE: [f64; 2] = [2.5e-3, 1e-4];

/// Two robots, their shared memory, and the programs that were started.
struct Team {
    home: tempfile::TempDir,
    space: Space,
    programs: Vec<Child>,
}

impl Team {
    fn new() -> Self {
        let home = tempfile::tempdir().unwrap();
        let root = home.path().join("shm");
        let space = Space::open(&root, PREFIX, "test").unwrap();
        let team = Self {
            home,
            space,
            programs: Vec::new(),
        };
        for (place, name) in ROBOTS.iter().enumerate() {
            let text = format!(
                "[robot]\nname = \"{name}\"\nid = {}\n[[team]]\nname = \"a\"\nid = 1\n[[team]]\nname = \"b\"\nid = 2\n\
                 [shm]\nroot = \"{}\"\nprefix = \"{PREFIX}\"\n[track]\n",
                place + 1,
                root.display()
            );
            std::fs::write(team.file(name), text).unwrap();
        }
        team
    }

    fn file(&self, name: &str) -> PathBuf {
        self.home.path().join(format!("{name}.toml"))
    }

    fn command(&self, word: &str, name: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_coloc-track"));
        command.arg(word).arg(self.file(name));
        command
    }

    fn start(&mut self, name: &str) {
        let mut command = self.command("run", name);
        let program = command.stderr(Stdio::piped()).spawn().unwrap();
        self.programs.push(program);
    }

    fn publisher<M: Message>(&self, name: &str) -> Publisher<M> {
        self.space
            .publisher(&RobotName::new(name).unwrap())
            .unwrap()
    }

    fn subscriber<M: Message>(&self, name: &str) -> Subscriber<M> {
        self.space
            .subscriber(&RobotName::new(name).unwrap())
            .unwrap()
    }

    /// SIGTERM to all; status and words of each.
    fn stop(mut self) -> Vec<Output> {
        let programs = std::mem::take(&mut self.programs);
        let ended = programs.into_iter().map(|program| {
            let pid = Pid::from_raw(program.id().cast_signed()).unwrap();
            kill_process(pid, Signal::TERM).unwrap();
            program.wait_with_output().unwrap()
        });
        ended.collect()
    }
}

impl Drop for Team {
    fn drop(&mut self) {
        for program in &mut self.programs {
            let _ = program.kill();
            let _ = program.wait();
        }
    }
}

/// The truth: both drive in circles. Where a robot is, so many seconds after it began.
fn truth(robot: usize, seconds: f64) -> [f64; 3] {
    let ([v, omega], [x, y, phi]) = [
        ([0.3, 0.2], [0.0, 0.0, 0.0]),
        ([0.2, -0.3], [2.0, 0.5, 0.4]),
    ][robot];
    let (radius, turned): (f64, f64) = (v / omega, phi + omega * seconds);
    [
        x + radius * (turned.sin() - phi.sin()),
        y - radius * (turned.cos() - phi.cos()),
        turned,
    ]
}

/// Where `to` is, seen from `from`.
fn seen_from(from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = from[2].sin_cos();
    let [x, y] = [to[0] - from[0], to[1] - from[1]];
    [cos * x + sin * y, cos * y - sin * x, to[2] - from[2]]
}

/// What the two daemons and cameras say.
struct Voices {
    begun_ns: i64,
    ports: [(Publisher<Estimate>, Publisher<Sighting>); 2],
    senders: [[Sender; 2]; 2],
    ticks: u32,
    /// Whether robot b sees robot a as well.
    both_see: bool,
}

impl Voices {
    fn of(team: &Team, both_see: bool) -> Self {
        let sender = |number| Sender::start(number, Clock::Boottime).unwrap();
        Self {
            begun_ns: Moment::now().boottime_ns,
            ports: ROBOTS.map(|name| (team.publisher(name), team.publisher(name))),
            senders: [1, 2].map(|robot| [sender(robot), sender(0)]),
            ticks: 0,
            both_see,
        }
    }

    fn seconds(&self, at_ns: i64) -> f64 {
        Duration::from_nanos((at_ns - self.begun_ns).try_into().unwrap()).as_secs_f64()
    }

    /// What both say at this moment.
    fn speak(&mut self) {
        let now_ns = Moment::now().boottime_ns;
        let seconds = self.seconds(now_ns);
        self.ticks += 1;
        for robot in 0..2 {
            let pose = truth(robot, seconds);
            let [daemon, camera] = &mut self.senders[robot];
            let estimate = Estimate {
                header: daemon.header(now_ns),
                boot_ns: now_ns,
                pose,
                odometry: pose,
                independent: [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.01],
                velocity_covariance: [1e-3, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-3],
                ..Estimate::default()
            };
            self.ports[robot].0.send(estimate).unwrap();
            let sees = robot == 0 || self.both_see;
            if sees && self.ticks.is_multiple_of(EVERY) {
                let other = seen_from(pose, truth(1 - robot, seconds));
                let header = camera.header(now_ns);
                self.ports[robot]
                    .1
                    .send(sighting(header, robot, other))
                    .unwrap();
            }
        }
    }

    /// How far a track is from the truth: position and heading \[m, rad\].
    fn error(&self, track: &Tracked) -> [f64; 2] {
        let seconds = self.seconds(track.header.stamp_ns);
        let [x, y, phi] = seen_from(truth(0, seconds), truth(1, seconds));
        let off = (track.pose[2] - phi).rem_euclid(std::f64::consts::TAU);
        let turned = off.min(std::f64::consts::TAU - off);
        [(track.pose[0] - x).hypot(track.pose[1] - y), turned]
    }
}

fn sighting(header: Header, robot: usize, [x, y, _]: [f64; 3]) -> Sighting {
    Sighting {
        header,
        observed: if robot == 0 { 2 } else { 1 },
        has: Sighting::RANGE | Sighting::BEARING,
        who: Sighting::ROBOT,
        range: x.hypot(y),
        bearing: y.atan2(x),
        white: WHITE,
        ..Sighting::default()
    }
}

/// Lets both speak until `heard` hears what it wants.
fn until<T>(voices: &mut Voices, mut heard: impl FnMut(&Voices) -> Option<T>) -> T {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        voices.speak();
        let turn = Instant::now();
        while turn.elapsed() < TICK {
            if let Some(heard) = heard(voices) {
                return heard;
            }
            std::thread::yield_now();
        }
    }
    panic!("nothing was heard for {PATIENCE:?}");
}

fn is_valid(track: &Tracked) {
    let now = Moment::now();
    let limits = Limits {
        now: Present {
            boottime_ns: Some(now.boottime_ns),
            ..Present::default()
        },
        boot: boot(),
        history_ns: 10_000_000_000,
        future_tolerance_ns: 0,
        own: 1,
        robots: &[1, 2],
    };
    track.validate(&limits).unwrap();
}

#[test]
fn robots_that_see_one_another_know_where_the_other_is_and_looks() {
    let mut team = Team::new();
    let tracks = team.subscriber::<Tracked>("a");
    for name in ROBOTS {
        team.start(name);
    }
    let mut voices = Voices::of(&team, true);
    let track = until(&mut voices, |_| {
        let heard = tracks.receive().unwrap();
        heard.filter(|it| it.has_heading() && it.status == Tracked::CONFIRMED)
    });
    is_valid(&track);
    assert_eq!((track.observed, track.header.source), (2, 1));
    assert_eq!(track.header.clock(), Ok(Clock::Boottime));
    let [metres, radians] = voices.error(&track);
    assert!(
        metres < 0.1 && radians < 0.2,
        "{metres} m, {radians} rad: {track:?}"
    );
    for ended in team.stop() {
        assert!(ended.status.success(), "{ended:?}");
        let said = String::from_utf8(ended.stderr).unwrap();
        assert!(said.contains("sensor 0 is heard"), "{said}");
    }
}

#[test]
fn who_sees_alone_has_the_position_first_and_the_heading_once_the_other_moved() {
    let mut team = Team::new();
    let tracks = team.subscriber::<Tracked>("a");
    team.start("a");
    team.start("b");
    let mut voices = Voices::of(&team, false);
    let first = until(&mut voices, |_| tracks.receive().unwrap());
    is_valid(&first);
    assert!(!first.has_heading(), "{first:?}");
    assert!(voices.error(&first)[0] < 0.1, "{first:?}");
    let turned = until(&mut voices, |_| {
        let heard = tracks.receive().unwrap();
        heard.filter(Tracked::has_heading)
    });
    let sigma = turned.covariance[8].sqrt();
    assert!(sigma < 0.35, "{turned:?}");
    assert!(voices.error(&turned)[1] < 4.0 * sigma, "{turned:?}");
}

#[test]
fn the_others_are_told_how_this_robot_moved_and_where_it_saw_them() {
    let mut team = Team::new();
    let increments = team.subscriber::<Increment>("b");
    team.start("a");
    let mut voices = Voices::of(&team, false);
    let (mut motion, mut bearing) = (None, None);
    let [moved, seen] = until(&mut voices, |_| {
        let heard = increments.receive().unwrap()?;
        if heard.has_motion() {
            motion = Some(heard);
        }
        if heard.has_bearing() {
            bearing = Some(heard);
        }
        Some([motion?, bearing?])
    });
    assert_eq!(moved.header.source, 1);
    // By the clock of the configuration, which the others have too.
    assert_eq!(moved.header.clock(), Ok(Clock::Realtime));
    let took = Duration::from_nanos((moved.header.stamp_ns - moved.start_ns).try_into().unwrap());
    let [x, _, turned] = moved.displacement;
    assert!((x - 0.3 * took.as_secs_f64()).abs() < 1e-3, "{moved:?}");
    assert!(
        (turned - 0.2 * took.as_secs_f64()).abs() < 1e-6,
        "{moved:?}"
    );
    assert!(moved.covariance[0] > 0.0 && moved.covariance[8] > 0.0);
    assert!((-1.6..1.6).contains(&seen.bearing), "{seen:?}");
    assert!((seen.bearing_variance - WHITE[1]).abs() < 1e-12, "{seen:?}");
}

#[test]
fn a_status_and_a_check_say_what_is_going_on() {
    let mut team = Team::new();
    let statuses = team.subscriber::<DriverStatus>("a");
    team.start("a");
    let mut voices = Voices::of(&team, false);
    let status = until(&mut voices, |_| {
        let heard = statuses.receive().unwrap();
        heard.filter(|it| it.figures[0] > 0.0 && it.health() == Health::Ok)
    });
    assert_eq!(status.name(), "track");
    assert!(status.whole > 0 && status.said > 0, "{status:?}");
    let checked = team.command("check", "a").output().unwrap();
    let said = String::from_utf8(checked.stdout).unwrap();
    assert!(
        checked.status.success() && said.contains("robot 2      b"),
        "{said}"
    );
}
