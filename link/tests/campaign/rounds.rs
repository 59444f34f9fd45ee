//! Rounds and evidence over links: what a team says to all of itself, with daemons and programs in spaces of their own.
use std::time::{Duration, Instant};

use coloc_shm_types::{
    Call, Clock, DriverStatus, Integrity, Message, Odometry, OdometryKind, Position, Publisher,
    RelativePose, Sender, Shared, Subscriber,
};

use crate::Extent;
use crate::process::Process;
use crate::support::{PATIENCE, wall_ns};
use crate::team::{Robot, team};

const ROBOTS: u16 = 3;
/// Where they stand, and look.
const POSES: [[f64; 3]; 3] = [[0.0, 0.0, 0.1], [4.0, 0.5, 1.0], [3.0, 4.0, -2.0]];
/// From one word of the wheels to the next.
const PERIOD: Duration = Duration::from_millis(20);
/// Other sensors speak every so many of them.
const EVERY: u32 = 5;
/// In the figures of `coloc-rounds` the newest round that is known.
const KNOWN: usize = 1;
/// The same, how many it has led.
const LED: usize = 4;
/// The same, how many it has followed.
const FOLLOWED: usize = 5;
/// The same, how often it has joined anew.
const JOINED: usize = 6;

struct Mouth<M: Message> {
    port: Publisher<M>,
    sender: Sender,
}

impl<M: Message> Mouth<M> {
    fn new(robot: &Robot) -> Self {
        Self {
            port: robot.space.publisher(&robot.name()).unwrap(),
            sender: Sender::start(0, Clock::Realtime).unwrap(),
        }
    }
}

/// Sensors of a robot that stands.
struct Body {
    wheels: Mouth<Odometry>,
    laser: Mouth<RelativePose>,
    /// Only one has it.
    receiver: Option<Mouth<Position>>,
    place: usize,
}

impl Body {
    fn new(place: usize, robot: &Robot) -> Self {
        Self {
            wheels: Mouth::new(robot),
            laser: Mouth::new(robot),
            receiver: (place == 0).then(|| Mouth::new(robot)),
            place,
        }
    }

    /// A full channel of a program that is not there yet is no matter here.
    fn drive(&mut self, [before_ns, now_ns]: [i64; 2]) {
        let _ = self.wheels.port.send(Odometry {
            header: self.wheels.sender.header(now_ns),
            start_ns: before_ns,
            kind: OdometryKind::Twist as u8,
            ..Odometry::default()
        });
    }

    fn sense(&mut self, now_ns: i64) {
        let [x, y, phi] = POSES[self.place];
        if let Some(receiver) = &mut self.receiver {
            let _ = receiver.port.send(Position {
                header: receiver.sender.header(now_ns),
                quality: 4,
                position: [x, y],
                covariance: [0.01, 0.0, 0.0, 0.01],
                ..Position::default()
            });
        }
        for (other, [ox, oy, ophi]) in (0..).zip(POSES) {
            if other == self.place {
                continue;
            }
            let (dx, dy, (sin, cos)) = (ox - x, oy - y, phi.sin_cos());
            let _ = self.laser.port.send(RelativePose {
                header: self.laser.sender.header(now_ns),
                observed: u16::try_from(other + 1).unwrap(),
                pose: [cos * dx + sin * dy, cos * dy - sin * dx, ophi - phi],
                covariance: [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 3e-4],
                ..RelativePose::default()
            });
        }
    }
}

/// The team, its sensors and its programs.
struct Stage {
    programs: Vec<Process>,
    bodies: Vec<Body>,
    robots: Vec<Robot>,
    tick: u32,
    before_ns: i64,
    _home: tempfile::TempDir,
}

impl Stage {
    /// Each robot has `colocd` and this program beside it, and a link between them.
    fn start(program: &str, section: &str) -> Self {
        let home = tempfile::tempdir().unwrap();
        let mut robots = team(home.path(), ROBOTS);
        let bodies = (0..).zip(&robots);
        let bodies: Vec<_> = bodies
            .map(|(place, robot)| Body::new(place, robot))
            .collect();
        let mut programs = Vec::new();
        for (robot, [x, y, phi]) in robots.iter_mut().zip(POSES) {
            let own = format!(
                "[odometry]\nmax_speed_mps = 2.0\nmax_turn_rate_radps = 3.0\n[odometry.base]\n\
                 [realtime]\nscheduler = \"other\"\nlock_memory = false\n\
                 [initial]\npose = [{x:?}, {y:?}, {phi:?}]\nsigma = [0.3, 0.3, 0.1]\n{section}"
            );
            robot.configure(|text| text.replace("[initial]\npose = [0.0, 0.0, 0.0]\n", &own));
            robot.start_link();
            robot.start_daemon();
            programs.push(robot.program(program));
        }
        Self {
            programs,
            bodies,
            robots,
            tick: 0,
            before_ns: wall_ns(),
            _home: home,
        }
    }

    fn turn(&mut self) {
        std::thread::sleep(PERIOD);
        let now_ns = wall_ns();
        for body in &mut self.bodies {
            body.drive([self.before_ns, now_ns]);
            if self.tick.is_multiple_of(EVERY) {
                body.sense(now_ns);
            }
        }
        (self.before_ns, self.tick) = (now_ns, self.tick + 1);
    }

    fn go_on(&mut self, seconds: f64) {
        let begin = Instant::now();
        while begin.elapsed().as_secs_f64() < seconds {
            self.turn();
        }
    }

    /// How long it takes until that is so (s).
    fn until(&mut self, what: &str, mut is_so: impl FnMut() -> bool) -> f64 {
        let begin = Instant::now();
        while !is_so() {
            self.turn();
            assert!(begin.elapsed() < PATIENCE, "never: {what}");
        }
        begin.elapsed().as_secs_f64()
    }

    /// A port on that channel of each robot, in its own space.
    fn ears<M: Message>(&self) -> Vec<Subscriber<M>> {
        let robots = self.robots.iter();
        robots
            .map(|it| it.space.subscriber(&it.name()).unwrap())
            .collect()
    }

    /// The figures of that robot's `coloc-rounds`, which has told the newest of them in the last two seconds.
    fn counts(&mut self, place: usize) -> [f64; 8] {
        let robot = &self.robots[place];
        let port = robot
            .space
            .subscriber::<DriverStatus>(&robot.name())
            .unwrap();
        let mut newest = None;
        self.until("coloc-rounds says how it is doing", || {
            while let Ok(Some(status)) = port.receive() {
                let is_of_rounds = status.name() == "rounds";
                newest = Some(status.figures).filter(|_| is_of_rounds).or(newest);
            }
            newest.is_some()
        });
        newest.unwrap()
    }
}

/// What each robot said last of its standing.
struct Standings {
    ears: Vec<Subscriber<Shared>>,
    newest: Vec<Option<Shared>>,
}

impl Standings {
    fn listen(&mut self) {
        for (ear, newest) in self.ears.iter().zip(&mut self.newest) {
            while let Ok(Some(shared)) = ear.receive() {
                *newest = Some(shared);
            }
        }
    }

    /// Each has followed a round of the last slots.
    fn all_are_with_their_team(&mut self) -> bool {
        self.listen();
        let is_with = |it: &Option<Shared>| {
            it.is_some_and(|it| it.standing == Shared::SINCE && it.since + 3 >= it.slot)
        };
        self.newest.iter().all(is_with)
    }

    fn forget(&mut self) {
        self.listen();
        self.newest = vec![None; self.ears.len()];
    }
}

/// A team makes rounds over its links; one whose link is killed misses some, asks for the newest, and is with them again.
pub(crate) fn rounds(extent: Extent) {
    let rules = "[fusion]\nmode = \"rounds\"\n[rounds]\nrate_hz = 2.0\n";
    let mut stage = Stage::start("coloc-rounds", rules);
    let mut standings = Standings {
        ears: stage.ears(),
        newest: vec![None; usize::from(ROBOTS)],
    };
    let first_s = stage.until("all are with their team", || {
        standings.all_are_with_their_team()
    });
    println!("rounds: all three are with their team after {first_s:.1} s");
    let begin = Instant::now();
    let before = stage.counts(2);
    stage.go_on(extent.of(1.0, 30.0));
    let after = stage.counts(2);
    let per_s = |place: usize| (after[place] - before[place]) / begin.elapsed().as_secs_f64();
    println!(
        "rounds: of robot3 {:.2} a second led and {:.2} followed, of 2",
        per_s(LED),
        per_s(FOLLOWED)
    );
    let calls = stage.ears::<Call>();
    let others: Vec<Subscriber<Call>> = (1..=ROBOTS)
        .map(|id| {
            stage.robots[2]
                .space
                .subscriber(&crate::support::name(id))
                .unwrap()
        })
        .collect();
    for _ in 0..extent.of(1, 5) {
        let known = stage.counts(2);
        stage.robots[2].link.as_mut().unwrap().kill();
        stage.go_on(1.2);
        stage.robots[2].start_link();
        standings.forget();
        let again_s = stage.until("all are with their team again", || {
            standings.all_are_with_their_team()
        });
        let now = stage.counts(2);
        let asked = |ears: &[Subscriber<Call>]| {
            let heard = ears.iter().flat_map(crate::support::all);
            heard.filter(|it: &Call| it.kind == Call::ASK).count()
        };
        let (of_own, of_all) = (asked(&calls), asked(&others));
        println!(
            "rounds: robot3 without a link for 1.2 s: with its team again after {again_s:.1} s, {of_own} questions were asked, {of_all} of them in its space, \
             it joined anew {} times, and knows {} rounds more",
            now[JOINED] - known[JOINED],
            now[KNOWN] - known[KNOWN]
        );
        assert!(now[KNOWN] > known[KNOWN], "it knows no newer round");
    }
    drop(stage.programs);
}

/// Only the first has a receiver: that the others' regions are bounded is by its evidence alone.
pub(crate) fn evidence(_: Extent) {
    let mut stage = Stage::start("coloc-bounds", "[bounds]\n[integrity]\n");
    let ears = stage.ears::<Integrity>();
    let mut newest = vec![None; ears.len()];
    let took_s = stage.until("all are bounded", || {
        for (ear, newest) in ears.iter().zip(&mut newest) {
            *newest = crate::support::all(ear).pop().or(*newest);
        }
        let is_bounded = |it: Integrity| it.state == Integrity::OK;
        newest.iter().all(|it| it.is_some_and(is_bounded))
    });
    println!("evidence: of three, one with a receiver, all are bounded after {took_s:.1} s");
}
