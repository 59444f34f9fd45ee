//! A base that does not speak CAN: what it says on the channel `odometry` moves the robot as wheels on a bus would.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod by_hand;

use by_hand::{PERIOD, SECOND, Subject, World, diagonal};
use coloc_daemon::event::Event;
use coloc_shm_types::{
    Clock, Estimate, Header, Heading, Health, Input, Odometry, OdometryKind, Publisher, Reject,
    SourceHealth, Status,
};
use proptest::{collection, prelude::*};

const TRACK_M: f64 = 0.5;
const METRES_PER_COUNT: f64 = 1e-5;

/// Each wheel's speed \[m/s\]: a turn to the left.
const SPEEDS: [f64; 2] = [0.4, 0.6];

const NOISE: &str = "[motion]\npreset = \"paper\"\nforward = { a = 1e-6 }\nturning = { a = 1e-6 }\n[initial]\nsigma = [0.01, 0.01, 1e-3]\n";

fn settings() -> String {
    format!(
        "[odometry]\nmax_speed_mps = 2.0\n[odometry.base]\ntrack_m = {TRACK_M}\n\
         metres_per_count = [{METRES_PER_COUNT}, {METRES_PER_COUNT}]\n{NOISE}"
    )
}

/// A base that says something every period, from a session of its own.
struct Driver {
    port: Publisher<Odometry>,
    header: Header,
    kind: OdometryKind,
    way_m: [f64; 2],
}

impl Driver {
    fn new(world: &World, kind: OdometryKind, session: u64) -> Self {
        Self {
            port: world.publisher("a"),
            header: Header {
                session,
                ..world.header(0)
            },
            kind,
            way_m: [0.0; 2],
        }
    }

    /// What it says now, after a period at these speeds of the wheels.
    fn say(&mut self, world: &World, [left, right]: [f64; 2]) {
        let dt_s = 0.02;
        self.way_m = [self.way_m[0] + left * dt_s, self.way_m[1] + right * dt_s];
        let [l, r] = self.way_m;
        let values = match self.kind {
            OdometryKind::Twist => [
                f64::midpoint(left, right),
                0.0,
                (right - left) / TRACK_M,
                0.0,
            ],
            OdometryKind::WheelDistances => [l, r, 0.0, 0.0],
            OdometryKind::WheelCounts => [l, r, 0.0, 0.0].map(|it| (it / METRES_PER_COUNT).round()),
        };
        self.send(world, values, [0.0; 9]);
    }

    fn send(&mut self, world: &World, values: [f64; 4], covariance: [f64; 9]) {
        self.header.stamp_ns = world.header(0).stamp_ns;
        let message = Odometry {
            header: self.header,
            kind: self.kind as u8,
            values,
            covariance,
            ..Odometry::default()
        };
        self.port.send(message).unwrap();
        self.header.sequence += 1;
    }
}

/// Counters as of the last tick.
fn counted(robot: &Subject) -> Status {
    robot.robot.account().status()
}

fn rejected(robot: &Subject, reason: Reject) -> u64 {
    counted(robot).rejected[Input::Odometry as usize][reason as usize]
}

/// Drives on until a second's books are closed.
fn row(world: &World, robot: &mut Subject, driver: &mut Driver) -> SourceHealth {
    books(robot);
    drive(world, robot, driver, 51);
    let status = books(robot).expect("a second has passed");
    let mut rows = status.sources();
    *rows
        .find(|(of, _)| *of == Input::Odometry)
        .expect("a row")
        .1
}

fn books(robot: &Subject) -> Option<Status> {
    let mut status = None;
    while let Some(event) = robot.link.next_event() {
        if let Event::Account(ledger) = event {
            status = Some(ledger.status);
            robot.link.give_back(ledger);
        }
    }
    status
}

/// Where such wheels bring a robot that began at the origin.
fn arc(seconds: f64) -> [f64; 3] {
    let [left, right] = SPEEDS;
    let (v, omega) = (f64::midpoint(left, right), (right - left) / TRACK_M);
    let phi = omega * seconds;
    [v / omega * phi.sin(), v / omega * (1.0 - phi.cos()), phi]
}

fn assert_at(estimate: &Estimate, expected: [f64; 3], within: f64) {
    for (found, expected) in estimate.pose.into_iter().zip(expected) {
        assert!(
            (found - expected).abs() < within,
            "{:?}, not {expected:?}",
            estimate.pose
        );
    }
}

/// Every period the driver speaks, then the robot ticks.
fn drive(world: &World, robot: &mut Subject, driver: &mut Driver, periods: u32) -> Estimate {
    let mut last = None;
    for _ in 0..periods {
        driver.say(world, SPEEDS);
        last = Some(robot.tick());
    }
    last.unwrap()
}

const KINDS: [OdometryKind; 3] = [
    OdometryKind::Twist,
    OdometryKind::WheelDistances,
    OdometryKind::WheelCounts,
];

#[test]
fn whatever_it_says_the_robot_goes_that_way() {
    for kind in KINDS {
        let world = World::new();
        let mut robot = world.robot("a", 1, &settings());
        let mut driver = Driver::new(&world, kind, 7);
        let end = drive(&world, &mut robot, &mut driver, 101);
        // The first one only says where counting starts; the last velocity is held from its stamp to the tick.
        assert_at(&end, arc(2.02), 5e-3);
        assert_eq!(end.health_of(Input::Odometry), Health::Ok);
        assert_eq!(counted(&robot).accepted_of(Input::Odometry), 100);
        assert_eq!(counted(&robot).can.samples, 100);
        assert_eq!(counted(&robot).rejected_total(Input::Odometry), 0);
        let row = row(&world, &mut robot, &mut driver);
        assert_eq!((row.health(), row.rejected, row.lost), (Health::Ok, 0, 0));
    }
}

/// The configuration need not say that it can.
#[test]
fn who_says_that_it_moves_sideways_does() {
    let world = World::new();
    let mut robot = world.robot("a", 1, &settings());
    let mut driver = Driver::new(&world, OdometryKind::Twist, 1);
    let estimates = [(); 51].map(|()| {
        driver.send(&world, [0.0, 0.4, 0.0, 0.0], [0.0; 9]);
        robot.tick()
    });
    // The first one only says where counting starts.
    let [_, begin, .., end] = estimates;
    let [x, y] = [0, 1].map(|axis| end.pose[axis] - begin.pose[axis]);
    let expected = 0.4 * 0.02 * 49.0;
    assert!(x.abs() < 1e-6 && (y - expected).abs() < 1e-6, "{x} {y}");
}

/// Five seconds of messages wait for a robot that is stopped: it takes them in before its tick, one after the other.
#[test]
fn a_robot_that_was_stopped_believes_what_its_twin_does() {
    for kind in KINDS {
        let ends = [false, true].map(|is_stopped| {
            let world = World::new();
            let mut robot = world.robot("a", 1, &settings());
            let mut driver = Driver::new(&world, kind, 7);
            drive(&world, &mut robot, &mut driver, 20);
            for _ in 0..240 {
                driver.say(&world, SPEEDS);
                if is_stopped {
                    world.time.run(PERIOD);
                } else {
                    robot.tick();
                }
            }
            let end = drive(&world, &mut robot, &mut driver, 20);
            assert_eq!(counted(&robot).accepted_of(Input::Odometry), 279);
            end
        });
        assert_at(&ends[1], ends[0].pose, 1e-9);
        for (one, other) in ends[0].independent.iter().zip(ends[1].independent) {
            assert!((one - other).abs() < 1e-9, "{kind:?}: {one} and {other}");
        }
    }
}

/// Whatever its number: it used to be counted for source 0.
#[test]
fn what_it_says_counts_for_its_own_source() {
    let world = World::new();
    let mut robot = world.robot("a", 1, &settings());
    let mut driver = Driver::new(&world, OdometryKind::Twist, 7);
    driver.header.source = 3;
    drive(&world, &mut robot, &mut driver, 60);
    let row = row(&world, &mut robot, &mut driver);
    assert_eq!((row.source, row.health()), (3, Health::Ok));
    assert!(row.accepted > 60, "{row:?}");
}

/// What pushes itself out of the queue is counted as lost, and the wheels' way is not: it is in the next sum.
#[test]
fn lost_messages_of_wheels_lose_no_way() {
    for kind in [OdometryKind::WheelDistances, OdometryKind::WheelCounts] {
        let world = World::new();
        let mut robot = world.robot("a", 1, &settings());
        let mut driver = Driver::new(&world, kind, 7);
        let straight = [0.5; 2];
        for period in 0..500 {
            driver.say(&world, straight);
            if (100..400).contains(&period) {
                world.time.run(PERIOD);
            } else {
                robot.tick();
            }
        }
        driver.say(&world, straight);
        let end = robot.tick();
        assert_at(&end, [0.5 * 0.02 * 501.0, 0.0, 0.0], 2e-3);
        assert_eq!(
            row(&world, &mut robot, &mut driver).lost,
            45,
            "301 came while 256 found room"
        );
    }
}

#[test]
fn who_claims_to_be_the_base_does_not_mute_it() {
    let world = World::new();
    let mut robot = world.robot("a", 1, &settings());
    let mut own = Driver::new(&world, OdometryKind::WheelDistances, 7);
    let mut foreign = Driver::new(&world, OdometryKind::WheelDistances, 8);
    for period in 0..101 {
        own.say(&world, SPEEDS);
        if period % 10 == 0 {
            foreign.say(&world, [0.0; 2]);
        }
        robot.tick();
    }
    assert_eq!(rejected(&robot, Reject::Implausible), 0);
    assert!(counted(&robot).accepted_of(Input::Odometry) >= 100);
    let row = row(&world, &mut robot, &mut own);
    assert!(row.accepted >= 100 && row.lost == 0, "{row:?}");
}

#[test]
fn what_does_not_count_is_refused_by_its_reason() {
    let world = World::new();
    let base = "[odometry]\nmax_speed_mps = 2.0\n[odometry.base]\ntrack_m = 0.5\n";
    let mut robot = world.robot("a", 1, base);
    let mut driver = Driver::new(&world, OdometryKind::WheelCounts, 7);
    robot.tick();
    driver.send(&world, [1.0, 1.0, 0.0, 0.0], [0.0; 9]);
    driver.send(&world, [1.5, 1.0, 0.0, 0.0], [0.0; 9]);
    driver.kind = OdometryKind::Twist;
    driver.send(&world, [2.1, 0.0, 0.0, 0.0], [0.0; 9]);
    driver.send(&world, [0.5, 0.0, 0.0, 0.0], diagonal([1e-4, 0.0, 0.0]));
    robot.tick();
    let reasons = [
        (Reject::NotConfigured, 1),
        (Reject::Unsupported, 1),
        (Reject::Implausible, 1),
        (Reject::NoCovariance, 1),
    ];
    for (reason, expected) in reasons {
        assert_eq!(rejected(&robot, reason), expected, "{reason:?}");
    }
    driver.send(&world, [0.5, 0.0, 0.0, 0.0], [0.0; 9]);
    robot.tick();
    let late = Odometry {
        header: Header {
            stamp_ns: world.header(0).stamp_ns - 5 * PERIOD,
            ..driver.header
        },
        ..Odometry::default()
    };
    driver.port.send(late).unwrap();
    let health = robot.tick().health_of(Input::Odometry);
    assert_eq!(rejected(&robot, Reject::OutOfOrder), 1);
    assert_ne!(health, Health::Ok);
}

/// A velocity that says over which interval it is the mean needs no other message; here on the wall clock.
#[test]
fn a_velocity_may_say_where_its_interval_begins_and_how_uncertain_it_is() {
    let world = World::new();
    let mut robot = world.robot("a", 1, &settings());
    let mut driver = Driver::new(&world, OdometryKind::Twist, 7);
    let start = robot.tick();
    for _ in 0..50 {
        robot.tick();
        world.time.run(PERIOD);
        let message = Odometry {
            header: Header {
                stamp_ns: world.header(0).stamp_ns,
                ..driver.header
            },
            start_ns: world.header(0).stamp_ns - 2 * PERIOD,
            values: [1.0, 0.0, 0.0, 0.0],
            covariance: diagonal([4e-2, 0.0, 1e-9]),
            ..Odometry::default()
        };
        driver.port.send(message).unwrap();
        driver.header.sequence += 1;
    }
    robot.tick();
    driver.send(&world, [0.0; 4], diagonal([4e-2, 0.0, 1e-9]));
    let end = robot.tick();
    assert_eq!(counted(&robot).accepted_of(Input::Odometry), 50);
    let way_m = end.pose[0] - start.pose[0];
    assert!((way_m - 2.0).abs() < 0.05, "{way_m}");
    // Each interval adds (σ · Δt)², however it is cut.
    let added = end.independent[0] + end.dependent[0] - start.independent[0] - start.dependent[0];
    let expected = 50.0 * 4e-2 * 0.04_f64.powi(2);
    assert!(
        (added - expected).abs() < 0.1 * expected,
        "{added}, not {expected}"
    );
}

/// The longer the interval, the less is said of any part of it.
#[test]
fn a_velocity_of_ages_is_no_certainty() {
    let world = World::new();
    let mut robot = world.robot("a", 1, &settings());
    let port = world.publisher::<Odometry>("a");
    let start = robot.tick();
    let message = Odometry {
        header: world.header(0),
        start_ns: i64::MIN,
        covariance: diagonal([1e-6, 0.0, 1e-6]),
        ..Odometry::default()
    };
    port.send(message).unwrap();
    robot.tick();
    let end = robot.tick();
    assert_eq!(counted(&robot).accepted_of(Input::Odometry), 1);
    assert!(end.total()[0] > 2.0 * start.total()[0], "{end:?}");
}

/// Any bytes that have the form of a message.
fn anything() -> impl Strategy<Value = Odometry> {
    let odd = prop_oneof![
        Just(0.0),
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(1e-308),
        Just(-1e308),
        -3.0..3.0,
    ];
    let stamp = prop_oneof![Just(0), Just(i64::MIN), Just(i64::MAX), -SECOND..SECOND];
    let odds = |number| collection::vec(odd.clone(), number);
    let numbers = (odds(4), odds(3));
    (numbers, (stamp.clone(), stamp), 0..4_u8, 0..5_u16, 0..5_u64).prop_map(
        |((values, variances), (offset_ns, start_ns), kind, source, session)| Odometry {
            header: Header {
                stamp_ns: offset_ns,
                source,
                session,
                clock: Clock::Realtime as u8,
                ..Header::default()
            },
            start_ns,
            kind,
            values: values.try_into().unwrap(),
            covariance: diagonal(variances.try_into().unwrap()),
            ..Odometry::default()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn whatever_it_says_the_estimate_stays_one(messages in collection::vec(anything(), 1..40)) {
        let world = World::new();
        let mut robot = world.robot("a", 1, &settings());
        let port = world.publisher::<Odometry>("a");
        let start = robot.tick();
        for (sequence, mut message) in (0..).zip(messages) {
            let now_ns = world.header(0).stamp_ns;
            message.header.sequence = sequence;
            message.header.stamp_ns = now_ns.saturating_add(message.header.stamp_ns);
            if message.start_ns != 0 {
                message.start_ns = now_ns.saturating_add(message.start_ns);
            }
            port.send(message).unwrap();
            let estimate = robot.tick();
            let total = estimate.total();
            prop_assert!(estimate.pose.iter().chain(&total).all(|it| it.is_finite()), "{estimate:?}");
            prop_assert!([0, 4, 8].iter().all(|&it| total[it] >= start.total()[it] * 0.5), "{estimate:?}");
        }
    }
}

/// Every preset has wheels that slip aside; that is no motion sideways.
#[test]
fn a_course_counts_of_wheels_that_slip() {
    for preset in ["differential", "skid-steer", "car", "mrclam", "paper"] {
        let world = World::new();
        let settings = format!(
            "[odometry]\nmax_speed_mps = 2.0\n[odometry.base]\ntrack_m = {TRACK_M}\n\
             [motion]\npreset = \"{preset}\"\n[initial]\nsigma = [0.01, 0.01, 0.1]\n"
        );
        let mut robot = world.robot("a", 1, &settings);
        let mut driver = Driver::new(&world, OdometryKind::Twist, 1);
        let receiver = world.publisher::<Heading>("a");
        for sequence in 0..10 {
            driver.say(&world, [1.0; 2]);
            let course = Heading {
                header: world.header(sequence),
                what: Heading::COURSE,
                quality: 1,
                variance: 0.01,
                ..Heading::default()
            };
            receiver.send(course).unwrap();
            robot.tick();
        }
        let status = counted(&robot);
        assert!(
            status.accepted_of(Input::Heading) >= 7,
            "{preset}: {} accepted, {} not moving",
            status.accepted_of(Input::Heading),
            status.rejected_of(Input::Heading, Reject::NotMoving)
        );
    }
}
