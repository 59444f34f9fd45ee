//! The program, as three robots run it: raw data of their sensors over shared memory, and an estimate of one of them that lies.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::time::Duration;

use coloc_rig::Rig;
use coloc_sensors::Moment;
use coloc_shm_types::{
    Clock, DriverStatus, Estimate, Evidence, Header, Heading, Health, Integrity, Limits, Odometry,
    OdometryKind, Position, Present, Publisher, RelativePose, Sender, Suspect, boot,
};

const ROBOTS: [&str; 3] = ["a", "b", "c"];
/// From one word of the wheels to the next.
const TICK: Duration = Duration::from_millis(20);
/// All other sensors every so many of them.
const EVERY: u32 = 5;
const COMPASS_RAD: f64 = 0.09;

/// Three robots. A loaded machine brings messages late: bounds of slots are wide, those of sensors are not.
fn team() -> Rig {
    let rig = Rig::new("bounds", env!("CARGO_BIN_EXE_coloc-bounds"));
    let more = format!(
        "[odometry]\nmax_speed_mps = 2.0\nmax_turn_rate_radps = 3.0\n[odometry.base]\n\
         [bounds]\nslot_s = 1.0\ngrace_s = 0.8\nsigmas = 3.0\ncompass_rad = {COMPASS_RAD}\n\
         [integrity]\nalarm_slots = 2\nclear_slots = 2\n"
    );
    for name in ROBOTS {
        rig.configure(name, &ROBOTS, &more);
    }
    rig
}

fn start(team: &mut Rig) {
    for name in ROBOTS {
        team.start(team.command("run", name));
    }
}

/// The truth: a drives in a circle, the others stand. Where a robot is, so many seconds after it began.
fn truth(robot: usize, seconds: f64) -> [f64; 3] {
    const V: f64 = 0.2;
    const OMEGA: f64 = 0.2;
    match robot {
        0 => {
            let turned = OMEGA * seconds;
            let radius = V / OMEGA;
            [radius * turned.sin(), radius * (1.0 - turned.cos()), turned]
        }
        1 => [4.0, 0.0, 1.0],
        _ => [0.0, 4.0, -2.0],
    }
}

fn velocity(robot: usize) -> [f64; 2] {
    if robot == 0 { [0.2, 0.2] } else { [0.0; 2] }
}

/// What lies, and how far [m].
#[derive(Copy, Clone, Debug, Default)]
struct Lies {
    estimate_of_c: f64,
    fix_of_a: f64,
}

/// Mouths of one robot's sensors, and of its daemon.
struct Voice {
    odometry: (Publisher<Odometry>, Sender),
    headings: (Publisher<Heading>, Sender),
    fixes: (Publisher<Position>, Sender),
    sightings: (Publisher<RelativePose>, Sender),
    estimates: (Publisher<Estimate>, Sender),
}

struct Voices {
    begun_ns: i64,
    /// When the wheels last spoke.
    before_ns: i64,
    robots: Vec<Voice>,
    ticks: u32,
    lies: Lies,
}

fn diagonal([x, y, phi]: [f64; 3]) -> [f64; 9] {
    [x * x, 0.0, 0.0, 0.0, y * y, 0.0, 0.0, 0.0, phi * phi]
}

impl Voices {
    fn of(team: &Rig) -> Self {
        let sender = |number| Sender::start(number, Clock::Boottime).unwrap();
        let voices = ROBOTS.iter().zip(1..).map(|(name, id)| Voice {
            odometry: (team.publisher(name), sender(0)),
            headings: (team.publisher(name), sender(0)),
            fixes: (team.publisher(name), sender(0)),
            sightings: (team.publisher(name), sender(0)),
            estimates: (team.publisher(name), sender(id)),
        });
        let now_ns = Moment::now().boottime_ns;
        Self {
            begun_ns: now_ns,
            before_ns: now_ns - 1,
            robots: voices.collect(),
            ticks: 0,
            lies: Lies::default(),
        }
    }

    fn seconds(&self, at_ns: i64) -> f64 {
        Duration::from_nanos((at_ns - self.begun_ns).try_into().unwrap()).as_secs_f64()
    }

    /// What all say at this moment.
    fn speak(&mut self) {
        let now_ns = Moment::now().boottime_ns;
        let seconds = self.seconds(now_ns);
        self.ticks += 1;
        let before_ns = std::mem::replace(&mut self.before_ns, now_ns);
        for (robot, voice) in self.robots.iter_mut().enumerate() {
            let [v, omega] = velocity(robot);
            let (port, sender) = &mut voice.odometry;
            let moved = Odometry {
                header: sender.header(now_ns),
                start_ns: before_ns,
                kind: OdometryKind::Twist as u8,
                values: [v, 0.0, omega, 0.0],
                ..Odometry::default()
            };
            port.send(moved).unwrap();
            let pose = truth(robot, seconds);
            voice.believe(robot, now_ns, pose, self.lies);
            if self.ticks.is_multiple_of(EVERY) {
                voice.sense(robot, now_ns, seconds, self.lies);
            }
        }
    }
}

impl Voice {
    fn believe(&mut self, robot: usize, now_ns: i64, pose: [f64; 3], lies: Lies) {
        let off = if robot == 2 { lies.estimate_of_c } else { 0.0 };
        let (port, sender) = &mut self.estimates;
        let estimate = Estimate {
            header: sender.header(now_ns),
            boot_ns: now_ns,
            pose: [pose[0] + off, pose[1], pose[2]],
            independent: diagonal([0.1; 3]),
            velocity_covariance: diagonal([0.01; 3]),
            ..Estimate::default()
        };
        port.send(estimate).unwrap();
    }

    fn sense(&mut self, robot: usize, now_ns: i64, seconds: f64, lies: Lies) {
        let [x, y, phi] = truth(robot, seconds);
        let (port, sender) = &mut self.headings;
        let compass = Heading {
            header: sender.header(now_ns),
            quality: 1,
            heading: phi + 0.5 * COMPASS_RAD,
            variance: 1e-4,
            ..Heading::default()
        };
        port.send(compass).unwrap();
        if robot < 2 {
            let off = if robot == 0 { lies.fix_of_a } else { 0.0 };
            let (port, sender) = &mut self.fixes;
            let fix = Position {
                header: sender.header(now_ns),
                quality: 4,
                position: [x + off + 0.1, y - 0.1],
                covariance: [0.01, 0.0, 0.0, 0.01],
                ..Position::default()
            };
            port.send(fix).unwrap();
        }
        for (other, id) in (0..3).zip(1..).filter(|it| it.0 != robot) {
            let [dx, dy] = [0, 1].map(|it| truth(other, seconds)[it] - [x, y][it]);
            let (sin, cos) = phi.sin_cos();
            let (port, sender) = &mut self.sightings;
            let seen = RelativePose {
                header: sender.header(now_ns),
                observed: id,
                pose: [
                    cos * dx + sin * dy,
                    cos * dy - sin * dx,
                    truth(other, seconds)[2] - phi,
                ],
                covariance: diagonal([0.1, 0.1, 0.02]),
                ..RelativePose::default()
            };
            port.send(seen).unwrap();
        }
    }
}

/// Lets all speak until `heard` hears what it wants.
fn until<T>(voices: &mut Voices, mut heard: impl FnMut() -> Option<T>) -> T {
    coloc_rig::until(voices, TICK, Voices::speak, |_| heard())
}

fn limits(own: u16) -> Limits<'static> {
    let now = Moment::now();
    Limits {
        now: Present {
            boottime_ns: Some(now.boottime_ns),
            realtime_ns: Some(now.realtime_ns),
            tai_ns: None,
        },
        boot: boot(),
        history_ns: 10_000_000_000,
        future_tolerance_ns: 0,
        own,
        robots: &[1, 2, 3],
    }
}

/// Whether the region holds where the robot was at its stamp, by `CLOCK_REALTIME` as the configuration has it.
fn holds(voices: &Voices, robot: usize, word: &Integrity) -> bool {
    let now = Moment::now();
    let at_ns = word.header.stamp_ns - (now.realtime_ns - now.boottime_ns);
    let at = truth(robot, voices.seconds(at_ns.max(voices.begun_ns)));
    let vertices = word.vertices();
    let next = vertices.iter().cycle().skip(1);
    vertices.len() > 2
        && vertices.iter().zip(next).all(|(a, b)| {
            let [ux, uy] = [b[0] - a[0], b[1] - a[1]];
            ux * (at[1] - a[1]) - uy * (at[0] - a[0]) >= -1e-6
        })
}

fn from_realtime(header: &Header) {
    assert_eq!(header.clock(), Ok(Clock::Realtime));
}

#[test]
fn an_estimate_that_lies_is_outside_and_a_fix_that_lies_is_named() {
    let mut team = team();
    let words: Vec<_> = ROBOTS.map(|name| team.subscriber::<Integrity>(name)).into();
    let evidence = team.subscriber::<Evidence>("b");
    let mut voices = Voices::of(&team);
    start(&mut team);

    // Everybody is found, and right.
    let mut good = [None; 3];
    until(&mut voices, || {
        for (robot, word) in words.iter().enumerate() {
            let heard = word.receive().unwrap();
            let is_good =
                |it: &Integrity| (it.state, it.contained) == (Integrity::OK, Integrity::YES);
            if let Some(word) = heard.filter(is_good) {
                good[robot] = Some(word);
            }
        }
        good.iter().all(Option::is_some).then_some(())
    });
    for (robot, word) in good.iter().enumerate() {
        let word = word.as_ref().unwrap();
        let id = u16::try_from(robot + 1).unwrap();
        word.validate(&limits(id)).unwrap();
        from_realtime(&word.header);
        assert_eq!((word.robot, word.header.source), (id, id));
        assert!(holds(&voices, robot, word), "{word:?}");
        assert!(
            word.area_m2 > 0.01 && word.protection_radius_m > 0.1,
            "{word:?}"
        );
    }
    let told = evidence.receive().unwrap().expect("b tells its evidence");
    told.validate(&limits(1)).unwrap();
    assert_eq!(told.seen_count, 2);
    assert_eq!(told.has, Evidence::FIX | Evidence::COMPASS);

    // The filter of c lies; nobody else's is suspected.
    voices.lies.estimate_of_c = 4.0;
    let outside = until(&mut voices, || {
        for word in &words[..2] {
            if let Some(word) = word.receive().unwrap() {
                assert_ne!(word.state, Integrity::ESTIMATE_OUTSIDE, "{word:?}");
            }
        }
        let heard = words[2].receive().unwrap();
        heard.filter(|it| it.state == Integrity::ESTIMATE_OUTSIDE)
    });
    assert_eq!(outside.contained, Integrity::NO);
    assert!((1.0..4.1).contains(&outside.distance_m), "{outside:?}");
    assert!(holds(&voices, 2, &outside), "{outside:?}");

    // The receiver of a lies: all name it, and nothing else.
    voices.lies = Lies {
        estimate_of_c: 0.0,
        fix_of_a: 5.0,
    };
    let mut named = [None; 3];
    until(&mut voices, || {
        for (robot, word) in words.iter().enumerate() {
            let heard = word.receive().unwrap();
            if let Some(word) = heard.filter(|it| it.state == Integrity::BOUNDS_VIOLATED) {
                named[robot].get_or_insert(word);
            }
        }
        named.iter().all(Option::is_some).then_some(())
    });
    for word in named.iter().flatten() {
        let [suspect] = word.conflicts() else {
            panic!("{word:?}");
        };
        assert_eq!((suspect.kind, suspect.robot), (Suspect::FIX, 1), "{word:?}");
    }

    let said: Vec<_> = team
        .stop()
        .into_iter()
        .map(|ended| {
            assert!(ended.status.success(), "{ended:?}");
            String::from_utf8(ended.stderr).unwrap()
        })
        .collect();
    assert!(
        said[2].contains("the estimate cannot be right"),
        "{}",
        said[2]
    );
    assert!(said[1].contains("the fixes of robot 1"), "{}", said[1]);
}

#[test]
fn a_status_and_a_check_say_what_is_going_on() {
    let mut team = team();
    let statuses = team.subscriber::<DriverStatus>("a");
    let mut voices = Voices::of(&team);
    start(&mut team);
    let status = until(&mut voices, || {
        let heard = statuses.receive().unwrap();
        heard.filter(|it| it.figures[0] > 1.0 && it.health() == Health::Ok)
    });
    assert_eq!(status.name(), "bounds");
    assert!(status.whole > 0 && status.said > 0, "{status:?}");
    let (status, said) = team.said("check", "a", &[]);
    assert!(
        status == Some(0) && said.contains("robot 2      b") && said.contains("within 0.09 rad"),
        "{said}"
    );
    let (status, said) = team.said("status", "a", &[]);
    assert!(status == Some(0) && said.contains("slots"), "{said}");
}

#[test]
fn there_is_one_of_it() {
    team().assert_alone("run", "a");
}
