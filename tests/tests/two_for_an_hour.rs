//! Two daemons on defaults for an hour of stamps: one is parked and gets fixes at 5 Hz, the other drives circles or stands, and they
//! see and tell one another every ten seconds. No message may be refused for its covariance.
//!
//! Real are both daemons' ticks from end to end: configuration, encoder frames on a bus, fixes, sightings and neighbours' poses
//! through shared memory, validation, history, estimator, publication and books. Not real are time, which runs a period ahead with each tick, and
//! the processes: both live in this one, without the wait for the tick and without telemetry's thread.
#![allow(clippy::unwrap_used)] // A test may panic.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use coloc_daemon::clock::TimeSource;
use coloc_daemon::config::{self, Config, Initial, InitialPose, Member, Shm};
use coloc_daemon::event::Link;
use coloc_daemon::tick::{Outcome, Robot};
use coloc_daemon::wait::Wake;
use coloc_drivers::can::{BusSpec, Sender};
use coloc_drivers::encoder::{OdometryConfig, WheelFrames};
use coloc_shm_types::{
    Clock as ShmClock, Header, Input, Position, Publisher, Reject, RelativePose, RobotName, Space,
    Status,
};
use coloc_tests::rig::{Clock, METRES_PER_TICK, PERIOD_NS, Stamps, TRACK_M};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const HOUR_S: u64 = 3600;
const TICKS_PER_SECOND: u64 = 50;
const PERIOD_S: f64 = 0.02;
/// Ticks from fix to fix, and from exchange to exchange.
const FIX: u64 = 10;
const EXCHANGE: u64 = 500;
const FIX_SIGMA_M: f64 = 0.1;
const SIGHTING_SIGMA: [f64; 3] = [0.1, 0.1, 0.017_453];
const OTHER_BEGINS: [f64; 3] = [2.0, 0.0, 0.0];
/// What the default noise says of two wheels: 2 cm after a metre, 0.4° after a second.
const SLIP_PER_ROOT_M: f64 = 0.02;
const TURN_PER_ROOT_S: f64 = 0.007;

/// Reasons that speak of a covariance, or of what is no number.
const OF_COVARIANCE: [Reject; 5] = [
    Reject::NotFinite,
    Reject::Asymmetric,
    Reject::NotPositiveSemidefinite,
    Reject::DependentNotPositiveSemidefinite,
    Reject::NoCovariance,
];

/// One of the two, with its wheels and its sensors.
struct Subject {
    robot: Box<Robot>,
    link: Arc<Link>,
    bus: Sender,
    frames: WheelFrames,
    wheels_m: [f64; 2],
    sightings: Publisher<RelativePose>,
    fixes: Publisher<Position>,
    velocity: [f64; 2],
    truth: [f64; 3],
    sent: u64,
}

struct Two {
    clock: Clock,
    subjects: [Subject; 2],
    noise: ChaCha8Rng,
    _directory: tempfile::TempDir,
}

fn name(index: usize) -> RobotName {
    RobotName::new(["parked", "other"][index]).unwrap()
}

/// As a person has it who sets nothing that has a default: who and where it is, its wheels, its team.
fn config(directory: &Path, index: usize) -> Config {
    let member = |index: usize| Member {
        name: name(index),
        id: u16::try_from(index + 1).unwrap(),
    };
    let Member { name, id } = member(index);
    let initial = match index {
        0 => Initial::default(),
        _ => Initial {
            pose: Some(InitialPose::Given(OTHER_BEGINS)),
            ..Initial::default()
        },
    };
    Config {
        team: (0..2).map(member).collect(),
        initial,
        shm: Shm {
            root: directory.join("shm"),
            prefix: "hour".into(),
            ..Shm::default()
        },
        odometry: Some(OdometryConfig::differential(
            bus(directory, index),
            TRACK_M,
            METRES_PER_TICK,
            5.0,
        )),
        ..Config::of(config::Robot { name, id })
    }
}

fn bus(directory: &Path, index: usize) -> BusSpec {
    BusSpec::Local {
        directory: directory.join(format!("bus{index}")),
    }
}

impl Subject {
    fn new(directory: &Path, index: usize, clock: &Clock, velocity: [f64; 2]) -> Self {
        let config = config(directory, index);
        let (root, name) = (&config.shm.root, name(index));
        let space = Space::open(root, &config.shm.prefix, name.as_str()).unwrap();
        let link = Arc::new(Link::new());
        let time = Box::new(clock.clone());
        Self {
            robot: Box::new(Robot::open(&config, &space, time, Arc::clone(&link)).unwrap()),
            link,
            bus: Sender::open(&bus(directory, index)).unwrap(),
            frames: WheelFrames::new(METRES_PER_TICK),
            wheels_m: [0.0; 2],
            sightings: space.publisher(&name).unwrap(),
            fixes: space.publisher(&name).unwrap(),
            velocity,
            truth: [[0.0; 3], OTHER_BEGINS][index],
            sent: 0,
        }
    }

    /// The wheels say what was meant; the robot slips.
    fn roll(&mut self, noise: &mut ChaCha8Rng) {
        let [v, omega] = self.velocity;
        let (way_m, turn) = (v * PERIOD_S, omega * PERIOD_S);
        self.wheels_m[0] += way_m - turn * TRACK_M / 2.0;
        self.wheels_m[1] += way_m + turn * TRACK_M / 2.0;
        let [left, right] = self.wheels_m;
        for frame in self.frames.encode(left, right) {
            self.bus.send(&frame).unwrap();
        }
        if way_m > 0.0 {
            let way_m = way_m + SLIP_PER_ROOT_M * way_m.sqrt() * normal(noise);
            let turn = turn + TURN_PER_ROOT_S * PERIOD_S.sqrt() * normal(noise);
            let [x, y, heading] = self.truth;
            let along = heading + turn / 2.0;
            self.truth = [
                x + way_m * along.cos(),
                y + way_m * along.sin(),
                heading + turn,
            ];
        }
    }

    fn header(&mut self, clock: &Clock) -> Header {
        self.sent += 1;
        Header {
            stamp_ns: clock.read().realtime_ns,
            session: 1,
            sequence: self.sent,
            clock: ShmClock::Realtime as u8,
            ..Header::default()
        }
    }

    fn fix(&mut self, clock: &Clock, noise: &mut ChaCha8Rng) {
        let [x, y, _] = self.truth;
        let message = Position {
            header: self.header(clock),
            quality: 4,
            position: [x, y].map(|exact| exact + FIX_SIGMA_M * normal(noise)),
            covariance: [FIX_SIGMA_M.powi(2), 0.0, 0.0, FIX_SIGMA_M.powi(2)],
            ..Position::default()
        };
        self.fixes.send(message).unwrap();
    }

    fn see(&mut self, other: [f64; 3], observed: u16, clock: &Clock, noise: &mut ChaCha8Rng) {
        let [x, y, heading] = self.truth;
        let (sin, cos) = heading.sin_cos();
        let [dx, dy] = [other[0] - x, other[1] - y];
        let exact = [cos * dx + sin * dy, cos * dy - sin * dx, other[2] - heading];
        let off = SIGHTING_SIGMA.map(|sigma| sigma * normal(noise));
        let [a, b, c] = SIGHTING_SIGMA.map(|sigma| sigma * sigma);
        let message = RelativePose {
            header: self.header(clock),
            observed,
            pose: std::array::from_fn(|axis| exact[axis] + off[axis]),
            covariance: [a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c],
            ..RelativePose::default()
        };
        self.sightings.send(message).unwrap();
    }

    fn tick(&mut self, deadline_ns: i64) {
        let wake = Wake::Deadline {
            deadline_ns,
            missed: 0,
        };
        assert_eq!(self.robot.wake(wake), Outcome::Ticked);
        // As telemetry does: a full ring would count losses.
        while self.link.next_event().is_some() {}
    }
}

impl Two {
    fn new(velocity_of_other: [f64; 2]) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let clock = Clock::new(Stamps::Plausible);
        let subject =
            |index: usize, velocity| Subject::new(directory.path(), index, &clock, velocity);
        Self {
            subjects: [subject(0, [0.0; 2]), subject(1, velocity_of_other)],
            clock,
            noise: ChaCha8Rng::seed_from_u64(12),
            _directory: directory,
        }
    }

    /// Their books after an hour of stamps.
    fn live(mut self) -> [Status; 2] {
        for tick in 1..=HOUR_S * TICKS_PER_SECOND {
            self.step(tick);
        }
        self.subjects
            .map(|subject| subject.robot.account().status())
    }

    fn step(&mut self, tick: u64) {
        let (clock, noise) = (&self.clock, &mut self.noise);
        for subject in &mut self.subjects {
            subject.roll(noise);
        }
        clock.run(PERIOD_NS);
        let [parked, other] = &mut self.subjects;
        if tick.is_multiple_of(FIX) {
            parked.fix(clock, noise);
        }
        if tick.is_multiple_of(EXCHANGE) {
            parked.see(other.truth, 2, clock, noise);
            other.see(parked.truth, 1, clock, noise);
        }
        let now_ns = clock.now_ns();
        for subject in &mut self.subjects {
            subject.tick(now_ns);
        }
    }
}

/// Box and Muller's.
fn normal(noise: &mut ChaCha8Rng) -> f64 {
    let [a, b]: [f64; 2] = noise.random();
    (-2.0 * (1.0 - a).ln()).sqrt() * (TAU * b).cos()
}

fn assert_understood(what: &str, index: usize, status: &Status) {
    let of = |reasons: &[Reject]| -> u64 {
        let counts = reasons.iter();
        counts
            .map(|&reason| status.rejected_of(Input::Neighbour, reason))
            .sum()
    };
    let accepted = status.accepted_of(Input::Neighbour);
    let covariance = of(&OF_COVARIANCE);
    let gated = of(&[Reject::Gated]);
    let all = status.rejected_total(Input::Neighbour);
    let fixes = status.accepted_of(Input::Position);
    println!(
        "{what}, robot {index}: of {} messages {accepted} accepted, {covariance} refused for their covariance, {gated} gated, {} \
         refused otherwise; {fixes} fixes accepted, {}",
        accepted + all,
        all - covariance - gated,
        status.state()
    );
    assert_eq!(covariance, 0, "{what}, robot {index}");
    assert_eq!(all, gated, "{what}, robot {index}");
    // The last may still be under way.
    let told = HOUR_S * TICKS_PER_SECOND / EXCHANGE;
    assert!((told - 1..=told).contains(&(accepted + all)), "{accepted}");
    // An honest gate of 99.9 % refuses some.
    assert!(gated < told / 20, "{what}, robot {index}: {gated} gated");
    assert_eq!(index == 0, fixes > 17_000, "{fixes} fixes");
    assert_eq!(status.losses.undelivered, 0);
}

fn live(what: &str, velocity_of_other: [f64; 2]) {
    let statuses = Two::new(velocity_of_other).live();
    for (index, status) in statuses.iter().enumerate() {
        assert_understood(what, index, status);
    }
}

#[test]
fn a_parked_daemon_and_one_that_drives_understand_each_other_for_an_hour() {
    live("the other drives circles", [0.5, 0.1]);
}

#[test]
fn two_parked_daemons_understand_each_other_for_an_hour() {
    live("the other stands", [0.0; 2]);
}
