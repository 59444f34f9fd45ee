//! Ticks driven by hand, with a clock of the test's own: what the daemon's loop does, to the nanosecond.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use std::path::Path;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, mpsc};

use coloc_daemon::clock::{Reading, TimeSource};
use coloc_daemon::config::Config;
use coloc_daemon::event::Link;
use coloc_daemon::tick::{Outcome, Robot};
use coloc_daemon::wait::Wake;
use coloc_drivers::can::{BusSpec, Sender};
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{
    Estimate, Header, Health, Input, Message, Neighbour, Position, Publisher, Reject, RelativePose,
    RobotName, Space, Subscriber,
};
use tempfile::TempDir;

const SECOND: i64 = 1_000_000_000;
const PERIOD: i64 = SECOND / 50;
const START: i64 = 1_000 * SECOND;

/// Two clocks that run only when told to, and step when told to.
#[derive(Clone, Default)]
struct TestTime(Arc<(AtomicI64, AtomicI64)>);

impl TestTime {
    fn run(&self, nanos: i64) {
        self.0.0.fetch_add(nanos, Ordering::Relaxed);
        self.0.1.fetch_add(nanos, Ordering::Relaxed);
    }

    fn step(&self, nanos: i64) {
        self.0.1.fetch_add(nanos, Ordering::Relaxed);
    }

    fn realtime(&self) -> i64 {
        self.read().realtime_ns
    }
}

impl TimeSource for TestTime {
    fn read(&self) -> Reading {
        let realtime_ns = self.0.1.load(Ordering::Relaxed);
        Reading {
            monotonic_ns: self.0.0.load(Ordering::Relaxed),
            realtime_ns,
            tai_ns: realtime_ns,
        }
    }
}

struct World {
    directory: TempDir,
    space: Space,
    time: TestTime,
}

/// A robot, and an ear on what it publishes.
struct Subject {
    robot: Robot,
    estimates: Subscriber<Estimate>,
    time: TestTime,
    link: Arc<Link>,
}

fn name(robot: &str) -> RobotName {
    RobotName::new(robot).unwrap()
}

impl World {
    fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let space = Space::open(&directory.path().join("shm"), "tick", "tick").unwrap();
        let time = TestTime::default();
        time.run(START);
        Self {
            directory,
            space,
            time,
        }
    }

    fn robot(&self, robot: &str, id: u16, lines: &str) -> Subject {
        let team = "[[team]]\nname = \"a\"\nid = 1\n[[team]]\nname = \"b\"\nid = 2\n";
        let text = format!("{team}[robot]\nname = \"{robot}\"\nid = {id}\n{lines}");
        let config = Config::parse(&text, Path::new("tick.toml")).unwrap();
        let link = Arc::new(Link::new());
        let estimates = self.space.subscriber(&name(robot)).unwrap();
        let robot = Robot::open(
            &config,
            &self.space,
            Box::new(self.time.clone()),
            Arc::clone(&link),
        )
        .unwrap();
        Subject {
            robot,
            estimates,
            time: self.time.clone(),
            link,
        }
    }

    fn publisher<M: Message>(&self, robot: &str) -> Publisher<M> {
        self.space.publisher(&name(robot)).unwrap()
    }

    fn bus(&self) -> String {
        format!("local:{}", self.directory.path().join("bus").display())
    }

    fn header(&self, sequence: u64) -> Header {
        Header {
            stamp_ns: self.time.realtime(),
            session_ns: START,
            sequence,
        }
    }
}

impl Subject {
    /// A period passes, and a tick on time.
    fn tick(&mut self) -> Estimate {
        self.time.run(PERIOD);
        let deadline_ns = self.time.read().monotonic_ns;
        assert_eq!(
            self.robot.wake(Wake::Deadline {
                deadline_ns,
                missed: 0
            }),
            Outcome::Ticked
        );
        self.estimates.receive().unwrap().expect("a tick publishes")
    }
}

fn diagonal(variances: [f64; 3]) -> [f64; 9] {
    let [a, b, c] = variances;
    [a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c]
}

#[test]
fn a_sensor_is_stale_on_the_first_tick_beyond_its_threshold() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let fixes = world.publisher::<Position>("a");
    robot.tick();
    fixes
        .send(Position {
            header: world.header(0),
            quality: 4,
            covariance: [1.0, 0.0, 0.0, 1.0],
            ..Position::default()
        })
        .unwrap();
    for tick in 1..=50 {
        assert_eq!(
            robot.tick().health_of(Input::Position),
            Health::Ok,
            "tick {tick}: a second has not passed"
        );
    }
    assert_eq!(robot.tick().health_of(Input::Position), Health::Stale);
}

#[test]
fn a_sighting_helps_the_robot_that_was_seen() {
    let world = World::new();
    let mut seer = world.robot("a", 1, "[initial]\nsigma = [0.01, 0.01, 0.001]\n");
    let mut seen = world.robot("b", 2, "[initial]\nsigma = [1.0, 1.0, 0.5]\n");
    let laser = world.publisher::<RelativePose>("a");
    let before = (seer.tick(), seen.tick());
    laser
        .send(RelativePose {
            header: world.header(0),
            observed: 2,
            pose: [0.5, 0.2, 0.1],
            covariance: diagonal([0.01, 0.01, 0.001]),
            ..RelativePose::default()
        })
        .unwrap();
    seer.tick();
    let after = seen.tick();
    assert!(
        (after.pose[0] - 0.5).abs() < 0.1 && (after.pose[1] - 0.2).abs() < 0.1,
        "{:?}",
        after.pose
    );
    assert!(after.total[0] < before.1.total[0] / 2.0);
    let account = seen.robot.account();
    assert_eq!(account.status.accepted_of(Input::Neighbour), 1);
    assert_eq!(
        seer.robot.account().status.accepted_of(Input::RelativePose),
        1
    );
}

/// One message of every kind that must change nothing. What a publisher sent is gone with it, so they come back too.
fn send_garbage(world: &World) -> (impl Sized, [u64; 3]) {
    let fixes = world.publisher::<Position>("a");
    let good = Position {
        header: world.header(0),
        quality: 4,
        covariance: [1.0, 0.0, 0.0, 1.0],
        ..Position::default()
    };
    let ahead = Header {
        stamp_ns: good.header.stamp_ns + SECOND,
        ..good.header
    };
    let behind = Header {
        stamp_ns: good.header.stamp_ns - 2 * SECOND,
        ..good.header
    };
    let bad_fixes = [
        Position {
            position: [f64::NAN, 0.0],
            ..good
        },
        Position {
            covariance: [1.0, 0.5, 0.0, 1.0],
            ..good
        },
        Position {
            covariance: [-1.0, 0.0, 0.0, 1.0],
            ..good
        },
        Position {
            header: ahead,
            ..good
        },
        Position {
            header: behind,
            ..good
        },
        Position { quality: 0, ..good },
    ];
    for fix in bad_fixes {
        fixes.send(fix).unwrap();
    }
    let sightings = world.publisher::<RelativePose>("a");
    let sighting = RelativePose {
        header: world.header(0),
        observed: 9,
        covariance: diagonal([1.0; 3]),
        ..RelativePose::default()
    };
    sightings.send(sighting).unwrap();
    let neighbours = world.publisher::<Neighbour>("a");
    let neighbour = Neighbour {
        header: world.header(0),
        sender: 1,
        total: diagonal([1.0; 3]),
        ..Neighbour::default()
    };
    neighbours.send(neighbour).unwrap();
    neighbours
        .send(Neighbour {
            sender: 2,
            total: diagonal([1.0; 3]),
            independent: diagonal([2.0; 3]),
            ..neighbour
        })
        .unwrap();
    (
        (fixes, sightings, neighbours),
        [bad_fixes.len() as u64, 1, 2],
    )
}

#[test]
fn what_is_rejected_changes_no_bit() {
    let run = |garbage: bool| {
        let world = World::new();
        let mut robot = world.robot("a", 1, "");
        robot.tick();
        let (_publishers, expected) = garbage.then(|| send_garbage(&world)).unzip();
        let estimates: Vec<_> = (0..5)
            .map(|_| robot.tick())
            .map(|it| {
                (
                    it.header.stamp_ns,
                    it.pose.map(f64::to_bits),
                    it.total.map(f64::to_bits),
                )
            })
            .collect();
        let status = robot.robot.account().status;
        let rejected = [Input::Position, Input::RelativePose, Input::Neighbour]
            .map(|input| status.rejected_total(input));
        assert_eq!(rejected, expected.unwrap_or_default());
        estimates
    };
    assert_eq!(run(true), run(false));
}

/// It waits in the history like any other, so the belief is propagated in two legs: equal but for rounding.
#[test]
fn an_outlier_is_gated() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let fixes = world.publisher::<Position>("a");
    robot.tick();
    fixes
        .send(Position {
            header: world.header(0),
            quality: 4,
            position: [1e6, 0.0],
            covariance: [1.0, 0.0, 0.0, 1.0],
            ..Position::default()
        })
        .unwrap();
    assert_eq!(robot.tick().pose.map(f64::to_bits), [0; 3]);
    let status = robot.robot.account().status;
    assert_eq!(
        (
            status.rejected_of(Input::Position, Reject::Gated),
            status.accepted_of(Input::Position)
        ),
        (1, 0)
    );
}

#[test]
fn a_flood_of_rejects_is_counted_to_the_last() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let fixes = world.publisher::<Position>("a");
    for sequence in 0..200 {
        for _ in 0..16 {
            fixes
                .send(Position {
                    header: world.header(sequence),
                    quality: 0,
                    ..Position::default()
                })
                .unwrap();
        }
        robot.tick();
    }
    let status = robot.robot.account().status;
    assert_eq!(
        status.rejected_of(Input::Position, Reject::BadQuality),
        3200
    );
    assert!(
        status.lost_events > 0,
        "nobody drains the ring of {}",
        robot.link.events.capacity()
    );
}

#[test]
fn a_clock_step_moves_the_belief_along() {
    for step in [SECOND, -SECOND, 3600 * SECOND, -3600 * SECOND] {
        let world = World::new();
        let mut robot = world.robot("a", 1, "");
        let fixes = world.publisher::<Position>("a");
        let fix = |header| Position {
            header,
            quality: 4,
            position: [0.05, 0.0],
            covariance: [0.01, 0.0, 0.0, 0.01],
            ..Position::default()
        };
        fixes.send(fix(world.header(0))).unwrap();
        let before = (0..10).map(|_| robot.tick()).last().unwrap();
        world.time.step(step);
        let after = robot.tick();
        assert_eq!(
            after.header.stamp_ns,
            before.header.stamp_ns + PERIOD + step
        );
        assert_eq!(
            after.pose.map(f64::to_bits),
            before.pose.map(f64::to_bits),
            "a standing robot stays where it is"
        );
        assert!(
            after.total[0] >= before.total[0] && after.total[0] < before.total[0] + 0.01,
            "one tick's growth"
        );
        assert_eq!(after.health_of(Input::Position), Health::Ok, "nothing aged");
        fixes.send(fix(world.header(1))).unwrap();
        let fused = robot.tick();
        assert!(
            fused.total[0] < after.total[0],
            "fixes of the new clock are fused"
        );
    }
}

#[test]
fn half_a_sample_is_no_tick() {
    let world = World::new();
    let bus = world.bus();
    let wheel = |side| {
        format!(
            "{side} = {{ message = \"Wheel{}\", signal = \"Ticks\", metres_per_tick = 1e-4 }}",
            if side == "left" { "Left" } else { "Right" }
        )
    };
    let lines = format!(
        "[tick]\ntrigger = \"encoder\"\n[odometry]\nbuses = [\"{bus}\"]\nmax_speed_mps = 5.0\n[odometry.wheels]\ntrack_m = 0.3\n{}\n{}\n",
        wheel("left"),
        wheel("right")
    );
    let mut robot = world.robot("a", 1, &lines);
    let mut sender = Sender::open(&bus.parse::<BusSpec>().unwrap()).unwrap();
    let mut frames = WheelFrames::new(1e-4);
    let mut wake = |frame| {
        world.time.run(PERIOD / 2);
        sender.send(&frame).unwrap();
        robot.robot.wake(Wake::Frame)
    };
    let [left, right] = frames.encode(0.0, 0.0);
    assert_eq!(
        (wake(left), wake(right)),
        (Outcome::Incomplete, Outcome::Incomplete),
        "counting starts here"
    );
    let [left, right] = frames.encode(0.01, 0.01);
    assert_eq!(
        (wake(left), wake(right)),
        (Outcome::Incomplete, Outcome::Ticked)
    );
    assert_eq!(robot.robot.account().status.accepted_of(Input::Odometry), 1);
}

#[test]
fn a_robot_may_be_opened_and_driven_on_any_thread() {
    let (done, wait) = mpsc::channel();
    std::thread::spawn(move || {
        let world = World::new();
        done.send(world.robot("a", 1, "").tick().tick).unwrap();
    });
    assert_eq!(wait.recv().unwrap(), 0);
}
