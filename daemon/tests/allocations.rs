//! A tick allocates nothing, whatever arrives.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod by_hand;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use by_hand::{METRES_PER_TICK, PERIOD, World, diagonal};
use coloc_counting::{Calls, calls_during};
use coloc_daemon::config::Config;
use coloc_daemon::event::{Event, Link};
use coloc_daemon::wait::Wake;
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{
    Assist, AssistAck, Gyro, Header, Heading, Input, Neighbour, Odometry, OdometryKind, Pose,
    Position, Readings, RelativePose,
};

const TICKS: u64 = 10_000;

/// What is seen in part is in the whole's own test of allocations, rounds and second opinions are in their own, leaders and children are below.
const ELSEWHERE: [Input; 8] = [
    Input::Sighting,
    Input::Seen,
    Input::Answer,
    Input::Assist,
    Input::AssistAck,
    Input::Readings,
    Input::Correction,
    Input::Integrity,
];

/// What telemetry does with the ring: empties it and gives the ledgers back.
fn drain(link: &Link, done: &AtomicBool) {
    while !done.load(Ordering::Relaxed) {
        match link.next_event() {
            Some(Event::Account(ledger)) => link.give_back(ledger),
            Some(_) => {}
            None => std::thread::yield_now(),
        }
    }
}

/// By a map; now and then somebody sets it.
fn looking(header: Header) -> Heading {
    Heading {
        header,
        quality: 1,
        variance: 0.01,
        slow_sigma_rad: 0.1,
        slow_time_s: 10.0,
        ..Heading::default()
    }
}

fn said(header: Header, pose: [f64; 3]) -> Pose {
    Pose {
        header,
        set: u8::from(header.sequence % 1000 == 500),
        pose,
        covariance: diagonal([0.01; 3]),
        ..Pose::default()
    }
}

fn moved(header: Header, way_m: f64) -> Odometry {
    Odometry {
        header: Header {
            source: 1,
            session: 1 + header.sequence / 10,
            ..header
        },
        kind: OdometryKind::WheelDistances as u8,
        values: [way_m, way_m, 0.0, 0.0],
        ..Odometry::default()
    }
}

/// Four yaw rates, a millisecond apart.
fn turns(header: Header) -> impl Iterator<Item = Gyro> {
    (1..=4_u8).map(move |part| Gyro {
        header: Header {
            stamp_ns: header.stamp_ns - i64::from(4 - part) * 1_000_000,
            sequence: 4 * header.sequence + u64::from(part),
            ..header
        },
        rate_radps: 0.01,
        ..Gyro::default()
    })
}

#[test]
fn ticks_allocate_nothing() {
    let world = World::new();
    // Whoever is told where it is listens as well.
    let told = world
        .space
        .subscriber::<Neighbour>(&by_hand::name("b"))
        .unwrap();
    let settings = format!(
        "{}[odometry.base]\ntrack_m = 0.3\n[gyro]\nsource = \"channel\"\n\
         [canopen]\nbus = 0\nstart = true\nsync_period_s = 0.02\nnodes = [5]\n",
        world.wheels()
    );
    let mut robot = world.robot("a", 1, &settings);
    let base = world.publisher::<Odometry>("a");
    let map = world.publisher::<Pose>("a");
    let compass = world.publisher::<Heading>("a");
    let gyro = world.publisher::<Gyro>("a");
    let (laser, dgps, neighbour) = (
        world.publisher::<RelativePose>("a"),
        world.publisher::<Position>("a"),
        world.publisher::<Neighbour>("a"),
    );
    let (mut sender, mut frames) = (world.sender(), WheelFrames::new(METRES_PER_TICK));
    let done = Arc::new(AtomicBool::new(false));
    let (link, ended) = (Arc::clone(&robot.link), Arc::clone(&done));
    let telemetry = std::thread::spawn(move || drain(&link, &ended));
    let mut counted = Calls::NONE;
    for sequence in 0..TICKS {
        world.time.run(PERIOD / 2);
        let header = world.header(sequence);
        let way_m = 1e-3 * f64::from(u32::try_from(sequence).unwrap());
        for frame in frames.encode(way_m, way_m) {
            sender.send(&frame).unwrap();
        }
        // A base that is started again and again, beside the buses.
        base.send(moved(header, way_m)).unwrap();
        laser
            .send(RelativePose {
                header,
                observed: 2,
                covariance: diagonal([0.01; 3]),
                ..RelativePose::default()
            })
            .unwrap();
        // Every other fix is garbage.
        let quality = if sequence % 2 == 0 { 4 } else { 0 };
        dgps.send(Position {
            header,
            quality,
            position: [way_m, 0.0],
            covariance: [0.01, 0.0, 0.0, 0.01],
            lever_m: [0.3, 0.1],
            ..Position::default()
        })
        .unwrap();
        for turn in turns(header) {
            gyro.send(turn).unwrap();
        }
        let pose = [way_m, 0.0, 0.0];
        map.send(said(header, pose)).unwrap();
        compass.send(looking(header)).unwrap();
        neighbour
            .send(Neighbour {
                header: Header {
                    source: 2,
                    ..header
                },
                pose,
                dependent: diagonal([0.01; 3]),
                ..Neighbour::default()
            })
            .unwrap();
        world.time.run(PERIOD / 2);
        let (_, calls) = calls_during(|| {
            robot.robot.wake(Wake::Deadline {
                deadline_ns: 0,
                missed: sequence % 100 / 99,
            })
        });
        // The first tick connects the ports of this test, which came after the robot.
        assert!(told.receive().unwrap().is_some());
        if sequence > 0 {
            counted += calls;
        }
    }
    done.store(true, Ordering::Relaxed);
    telemetry.join().unwrap();
    let status = robot.robot.account().status();
    assert_eq!(counted, Calls::NONE);
    for input in Input::ALL.into_iter().filter(|it| !ELSEWHERE.contains(it)) {
        assert!(
            status.accepted_of(input) >= TICKS / 2 - 2,
            "{input}: {} accepted",
            status.accepted_of(input)
        );
    }
    assert_eq!(status.rejected_total(Input::Position), TICKS / 2);
    assert!(
        status.accepted_of(Input::Odometry) > TICKS * 3 / 2,
        "of both"
    );
}

/// A leader that sees a child at every tick, and a child that it tells; somebody answers what was never asked.
#[test]
fn ticks_of_leaders_and_children_allocate_nothing() {
    const ROUNDS: u64 = 2000;
    let world = World::new();
    let part = "[assist]\nfusion = \"cross\"\nleaders = [1]\nchildren = [2]\nperiod_s = 0.04\n[initial]\npose = ";
    let mut robots = [("a", 1, "[0.0, 0.0, 0.0]\n"), ("b", 2, "[2.0, 0.0, 0.0]\n")]
        .map(|(name, id, pose)| world.robot(name, id, &format!("{part}{pose}")));
    let laser = world.publisher::<RelativePose>("a");
    let acks = world.publisher::<AssistAck>("b");
    let done = Arc::new(AtomicBool::new(false));
    let telemetry = robots.each_ref().map(|robot| {
        let (link, ended) = (Arc::clone(&robot.link), Arc::clone(&done));
        std::thread::spawn(move || drain(&link, &ended))
    });
    let mut counted = Calls::NONE;
    for sequence in 0..ROUNDS {
        let header = world.header(sequence);
        laser
            .send(RelativePose {
                header,
                observed: 2,
                pose: [2.0, 0.0, 0.0],
                covariance: diagonal([0.01; 3]),
                ..RelativePose::default()
            })
            .unwrap();
        acks.send(AssistAck {
            header: Header {
                source: 1,
                ..header
            },
            leader: 1,
            ..AssistAck::default()
        })
        .unwrap();
        for robot in &mut robots {
            world.time.run(PERIOD / 2);
            let wake = Wake::Deadline {
                deadline_ns: 0,
                missed: 0,
            };
            let (_, calls) = calls_during(|| robot.robot.wake(wake));
            assert!(robot.estimates.receive().unwrap().is_some());
            // The first ticks connect the ports of this test, and of each other.
            if sequence > 1 {
                counted += calls;
            }
        }
    }
    done.store(true, Ordering::Relaxed);
    for it in telemetry {
        it.join().unwrap();
    }
    assert_eq!(counted, Calls::NONE);
    let [leader, child] = robots.map(|it| it.robot.account().status());
    let told = leader.assist.forwarded;
    assert!(
        told > ROUNDS / 4 && child.assist.accepted > ROUNDS / 4,
        "{told}"
    );
    assert!(
        child.rejected_total(Input::Assist) > ROUNDS / 2,
        "who never asked"
    );
}

const LEADERS: [u16; 3] = [1, 2, 3];
const CHILD: u16 = 4;
const CHILDREN: [u16; 15] = [5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19];
/// Five events a second.
const SLOT_NS: i64 = 200_000_000;

fn among_many() -> Config {
    let others = LEADERS.iter().chain(&CHILDREN);
    let member = |id: &u16| format!("[[team]]\nname = \"r{id}\"\nid = {id}\n");
    let team = others.map(member).collect::<Vec<_>>().concat();
    let text = format!(
        "{team}[robot]\nname = \"a\"\nid = {CHILD}\n[assist]\nfusion = \"cross\"\nleaders = {LEADERS:?}\nchildren = {:?}\n[initial]\npose = [0.0, 0.0, 0.0]\n",
        [&[CHILD][..], &CHILDREN].concat()
    );
    Config::parse(&text, Path::new("a.toml")).unwrap()
}

/// What is said of the child by the last but one of `way`; the header's count is that of its sender.
fn datum(header: Header, way: &[u16]) -> Assist {
    let mut path = [0; 16];
    path[..way.len()].copy_from_slice(way);
    let sender = way[way.len() - 2];
    Assist {
        header: Header {
            source: sender,
            sequence: 4 * header.sequence + u64::from(way[0]),
            ..header
        },
        slot: header.stamp_ns.div_euclid(SLOT_NS),
        independent: diagonal([0.01; 3]),
        dependent: diagonal([0.01; 3]),
        leader_covariance: diagonal([0.01; 3]),
        path,
        robots: u8::try_from(way.len()).unwrap(),
        ..Assist::default()
    }
}

/// Fifteen neighbours and three leaders: all that comes of an event comes with one tick.
#[test]
fn ticks_of_a_child_among_fifteen_allocate_nothing() {
    const EVENTS: u64 = 300;
    const TICKS_OF_ONE: usize = 10;
    let world = World::new();
    let mut child = world.robot_of(&among_many());
    let told: Vec<_> = CHILDREN
        .iter()
        .map(|id| {
            let name = by_hand::name(&format!("r{id}"));
            world.space.subscriber::<Assist>(&name).unwrap()
        })
        .collect();
    let laser = world.publisher::<RelativePose>("a");
    // Each robot speaks by a publisher of its own.
    let senders = LEADERS.iter().chain(&CHILDREN);
    let data: Vec<_> = senders.map(|_| world.publisher::<Assist>("a")).collect();
    let acks = CHILDREN.map(|_| world.publisher::<AssistAck>("a"));
    let (leaders, children) = data.split_at(LEADERS.len());
    let done = Arc::new(AtomicBool::new(false));
    let (link, ended) = (Arc::clone(&child.link), Arc::clone(&done));
    let telemetry = std::thread::spawn(move || drain(&link, &ended));
    let (mut counted, mut handed_on) = (Calls::NONE, 0);
    for event in 0..EVENTS {
        let header = world.header(event);
        for (sequence, observed) in (CHILDREN.len() as u64 * event..).zip(CHILDREN) {
            let seen = RelativePose {
                header: world.header(sequence),
                observed,
                pose: [f64::from(observed), 0.0, 0.0],
                covariance: diagonal([0.01; 3]),
                ..RelativePose::default()
            };
            laser.send(seen).unwrap();
        }
        for (port, leader) in leaders.iter().zip(LEADERS) {
            port.send(datum(header, &[leader, CHILD])).unwrap();
            for (port, robot) in children.iter().zip(CHILDREN) {
                port.send(datum(header, &[leader, robot, CHILD])).unwrap();
            }
        }
        for tick in 0..TICKS_OF_ONE {
            world.time.run(PERIOD);
            let wake = Wake::Deadline {
                deadline_ns: 0,
                missed: 0,
            };
            let (_, calls) = calls_during(|| child.robot.wake(wake));
            assert!(child.estimates.receive().unwrap().is_some());
            // The first events connect the ports of this test.
            if event > 1 {
                counted += calls;
            }
            if tick > 0 {
                continue;
            }
            for ((port, acks), source) in told.iter().zip(&acks).zip(CHILDREN) {
                while let Some(message) = port.receive().unwrap() {
                    handed_on += 1;
                    let ack = AssistAck {
                        header: Header { source, ..header },
                        slot: message.slot,
                        leader: message.path[0],
                        taken: 1,
                        ..AssistAck::default()
                    };
                    acks.send(ack).unwrap();
                }
            }
        }
    }
    done.store(true, Ordering::Relaxed);
    telemetry.join().unwrap();
    assert_eq!(counted, Calls::NONE);
    let assist = child.robot.account().status().assist;
    assert_eq!(assist.timed_out, 0);
    assert!(assist.accepted >= 3 * (EVENTS - 2), "{assist:?}");
    assert!(assist.declined >= 45 * (EVENTS - 2), "{assist:?}");
    assert!(handed_on >= 15 * (EVENTS - 2), "{handed_on} {assist:?}");
}

/// What a child says that sees the next one, of the event before this moment.
fn readings(header: Header, source: u16) -> Readings {
    let slot = header.stamp_ns.div_euclid(SLOT_NS) - 1;
    let mut readings = Readings {
        header: Header {
            source,
            session: u64::from(source),
            stamp_ns: slot * SLOT_NS + SLOT_NS / 2,
            ..header
        },
        slot,
        count: 1,
        ..Readings::default()
    };
    let [first, ..] = &mut readings.sights;
    first.covariance = diagonal([0.01; 3]);
    first.observed = if source == 19 { 5 } else { source + 1 };
    readings
}

/// It sees one of fifteen children, each of which sees the next one.
#[test]
fn ticks_of_a_leader_that_is_told_what_fifteen_see_allocate_nothing() {
    const EVENTS: u64 = 100;
    const TICKS_OF_ONE: usize = 10;
    let members = CHILDREN.map(|id| format!("[[team]]\nname = \"r{id}\"\nid = {id}\n"));
    let text = format!(
        "{}[robot]\nname = \"a\"\nid = 1\n[assist]\nmode = \"full\"\nleaders = [1]\nchildren = {CHILDREN:?}\n\
         [initial]\npose = [0.0, 0.0, 0.0]\n",
        members.concat()
    );
    let world = World::new();
    let mut leader = world.robot_of(&Config::parse(&text, Path::new("a.toml")).unwrap());
    let laser = world.publisher::<RelativePose>("a");
    let ports = CHILDREN.map(|_| world.publisher::<Readings>("a"));
    let done = Arc::new(AtomicBool::new(false));
    let (link, ended) = (Arc::clone(&leader.link), Arc::clone(&done));
    let telemetry = std::thread::spawn(move || drain(&link, &ended));
    let mut counted = Calls::NONE;
    for event in 0..EVENTS {
        let seen = RelativePose {
            header: world.header(event),
            observed: 5,
            pose: [2.0, 0.0, 0.0],
            covariance: diagonal([0.01; 3]),
            ..RelativePose::default()
        };
        laser.send(seen).unwrap();
        for (port, source) in ports.iter().zip(CHILDREN) {
            port.send(readings(world.header(event), source)).unwrap();
        }
        for _ in 0..TICKS_OF_ONE {
            world.time.run(PERIOD);
            let wake = Wake::Deadline {
                deadline_ns: 0,
                missed: 0,
            };
            let (_, calls) = calls_during(|| leader.robot.wake(wake));
            assert!(leader.estimates.receive().unwrap().is_some());
            if event > 1 {
                counted += calls;
            }
        }
    }
    done.store(true, Ordering::Relaxed);
    telemetry.join().unwrap();
    assert_eq!(counted, Calls::NONE);
    let assist = leader.robot.account().status().assist;
    assert!(assist.forwarded >= 15 * (EVENTS - 4), "{assist:?}");
}
