//! The program, as two robots run it: what they see of one another in part and what their daemons say of their wheels, over shared memory.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::time::Duration;

use coloc_rig::Rig;
use coloc_sensors::Moment;
use coloc_shm_types::{
    Clock, DriverStatus, Estimate, Header, Health, Increment, Limits, Present, Publisher, Sender,
    Sighting, Tracked, boot,
};

const ROBOTS: [&str; 2] = ["a", "b"];
/// From one word of a daemon to the next.
const TICK: Duration = Duration::from_millis(20);
/// A sighting every so many of them.
const EVERY: u32 = 5;
/// Of what is seen \[m², rad²\].
const WHITE: [f64; 2] = [2.5e-3, 1e-4];

/// Two robots, and the programs that were started.
fn team() -> Rig {
    let rig = Rig::new("track", env!("CARGO_BIN_EXE_coloc-track"));
    for name in ROBOTS {
        rig.configure(name, &ROBOTS, "[track]\n");
    }
    rig
}

fn start(team: &mut Rig, name: &str) {
    team.start(team.command("run", name));
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
    fn of(team: &Rig, both_see: bool) -> Self {
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
fn until<T>(voices: &mut Voices, heard: impl FnMut(&Voices) -> Option<T>) -> T {
    coloc_rig::until(voices, TICK, Voices::speak, heard)
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
    let mut team = team();
    let tracks = team.subscriber::<Tracked>("a");
    for name in ROBOTS {
        start(&mut team, name);
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
    let mut team = team();
    let tracks = team.subscriber::<Tracked>("a");
    start(&mut team, "a");
    start(&mut team, "b");
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
    let mut team = team();
    let increments = team.subscriber::<Increment>("b");
    start(&mut team, "a");
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
    let mut team = team();
    let statuses = team.subscriber::<DriverStatus>("a");
    start(&mut team, "a");
    let mut voices = Voices::of(&team, false);
    let status = until(&mut voices, |_| {
        let heard = statuses.receive().unwrap();
        heard.filter(|it| it.figures[0] > 0.0 && it.health() == Health::Ok)
    });
    assert_eq!(status.name(), "track");
    assert!(status.whole > 0 && status.said > 0, "{status:?}");
    let (status, said) = team.said("check", "a", &[]);
    assert!(
        status == Some(0) && said.contains("robot 2      b"),
        "{said}"
    );
    let (status, said) = team.said("status", "a", &[]);
    assert!(status == Some(0) && said.contains("\"whole\""), "{said}");
}

#[test]
fn there_is_one_of_it() {
    team().assert_alone("run", "a");
}
