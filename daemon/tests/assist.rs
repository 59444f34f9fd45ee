//! From a leader's sighting to the child that it sees, over shared memory and by hand.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod by_hand;

use by_hand::{Subject, World, diagonal};
use coloc_shm_types::{
    Assist, AssistAck, Header, Health, Input, Neighbour, Readings, Reject, RelativePose,
};

/// A leader counts for as sure as it says, though it has no wheels: `cross` would take its error for twice as large.
const PART: &str = "[assist]\nleaders = [1]\nchildren = [2]\nfusion = \"split\"\n";
const SLOT_NS: i64 = 200_000_000;

fn bits(pose: [f64; 3]) -> [u64; 3] {
    pose.map(f64::to_bits)
}

fn leader(world: &World) -> Subject {
    let lines = "[initial]\npose = [0.0, 0.0, 0.0]\nsigma = [0.02, 0.02, 0.01]\n";
    world.robot("a", 1, &format!("{PART}{lines}"))
}

fn child(world: &World) -> Subject {
    let lines = "[initial]\npose = [2.4, 0.0, 0.0]\nsigma = [0.5, 0.5, 0.1]\n";
    world.robot("b", 2, &format!("{PART}{lines}"))
}

/// Past the event in which they began.
fn pass(robots: &mut [&mut Subject]) {
    (0..12).for_each(|_| {
        for robot in robots.iter_mut() {
            robot.tick();
        }
    });
}

fn sighting(header: Header) -> RelativePose {
    RelativePose {
        header,
        observed: 2,
        pose: [2.0, 0.0, 0.0],
        covariance: diagonal([0.0025, 0.0025, 0.0003]),
        ..RelativePose::default()
    }
}

/// As the leader says it.
fn datum(world: &World, sequence: u64) -> Assist {
    let header = Header {
        source: 1,
        session: 77,
        ..world.header(sequence)
    };
    let mut path = [0; 16];
    (path[0], path[1]) = (1, 2);
    Assist {
        header,
        slot: header.stamp_ns.div_euclid(SLOT_NS),
        pose: [2.0, 0.0, 0.0],
        independent: diagonal([0.0025, 0.0025, 0.0003]),
        dependent: diagonal([0.0004, 0.0004, 0.0001]),
        leader_covariance: diagonal([0.0004, 0.0004, 0.0001]),
        path,
        robots: 2,
        ..Assist::default()
    }
}

/// What makes a message one that is refused, and why.
type Case = (fn(&mut Assist), Reject);

fn rejected(robot: &Subject, input: Input, reason: Reject) -> u64 {
    robot.robot.account().status().rejected_of(input, reason)
}

#[test]
fn a_leader_tells_the_child_that_it_sees_where_that_one_is() {
    let world = World::new();
    let (mut leader, mut child) = (leader(&world), child(&world));
    let laser = world.publisher::<RelativePose>("a");
    pass(&mut [&mut leader, &mut child]);
    laser.send(sighting(world.header(0))).unwrap();
    leader.tick();
    let told = child.tick();
    assert!((told.pose[0] - 2.0).abs() < 0.1, "{:?}", told.pose);
    // A σ of 0.5 m came to less than half, though neither has wheels: of both the doubt grows by 0.002 m² in every tick.
    assert!(told.total()[0] < 0.0625, "{:?}", told.total());
    assert_eq!(told.health_of(Input::Assist), Health::Ok);
    let status = |it: &Subject| it.robot.account().status();
    let (leader, child) = (status(&leader), status(&child));
    assert_eq!(leader.accepted_of(Input::RelativePose), 1);
    assert_eq!((leader.assist.forwarded, leader.assist.accepted), (1, 0));
    assert_eq!(child.accepted_of(Input::Assist), 1);
    assert_eq!((child.assist.accepted, child.assist.declined), (1, 0));
    assert_eq!(
        leader.rejected_total(Input::AssistAck),
        0,
        "it is not answered"
    );
}

#[test]
fn what_is_forged_is_refused_under_its_reason_and_changes_nothing() {
    let world = World::new();
    let mut child = child(&world);
    let port = world.publisher::<Assist>("b");
    pass(&mut [&mut child]);
    let cases: [Case; 7] = [
        (|it| it.path[0] = 2, Reject::NotForRole),
        (|it| (it.path[1], it.robots) = (0, 1), Reject::BadPath),
        (
            |it| (it.path[1], it.path[2], it.robots) = (9, 2, 3),
            Reject::UnknownRobot,
        ),
        (|it| it.robots = 17, Reject::Unsupported),
        (|it| it.flags = Assist::FINAL, Reject::Unsupported),
        (|it| it.slot += 1, Reject::WrongEvent),
        (|it| (it.path[2], it.robots) = (2, 3), Reject::Looped),
    ];
    for (sequence, (change, reason)) in (0..).zip(cases) {
        let before = (child.tick(), rejected(&child, Input::Assist, reason));
        let mut message = datum(&world, sequence);
        change(&mut message);
        port.send(message).unwrap();
        let after = child.tick();
        let count = rejected(&child, Input::Assist, reason);
        assert_eq!(count, before.1 + 1, "{reason:?}");
        assert_eq!(bits(after.pose), bits(before.0.pose), "{reason:?}");
    }
    let counted = child.robot.account().status().assist;
    assert_eq!((counted.accepted, counted.declined), (0, 0));
    // The search is as it was: the true one is taken, once.
    port.send(datum(&world, 20)).unwrap();
    port.send(datum(&world, 20)).unwrap();
    child.tick();
    let status = child.robot.account().status();
    assert_eq!(status.assist.accepted, 1);
    assert_eq!(status.rejected_of(Input::Assist, Reject::Replayed), 1);
}

#[test]
fn a_leader_takes_nothing_from_a_child() {
    let world = World::new();
    let mut leader = leader(&world);
    let (words, acks) = (
        world.publisher::<Neighbour>("a"),
        world.publisher::<AssistAck>("a"),
    );
    pass(&mut [&mut leader]);
    let before = leader.tick();
    let from = |sequence| Header {
        source: 2,
        session: 77,
        ..world.header(sequence)
    };
    let said = Neighbour {
        header: from(0),
        pose: [1.0, 0.0, 0.0],
        independent: diagonal([0.0025, 0.0025, 0.0003]),
        ..Neighbour::default()
    };
    words.send(said).unwrap();
    let ack = AssistAck {
        header: from(0),
        leader: 1,
        ..AssistAck::default()
    };
    acks.send(ack).unwrap();
    let after = leader.tick();
    assert_eq!(bits(after.pose), bits(before.pose));
    assert_eq!(rejected(&leader, Input::Neighbour, Reject::NotForRole), 1);
    assert_eq!(rejected(&leader, Input::Assist, Reject::NotForRole), 1);
}

#[test]
fn who_has_no_part_hears_nothing() {
    let world = World::new();
    let mut robot = world.robot("b", 2, "");
    let port = world.publisher::<Assist>("b");
    pass(&mut [&mut robot]);
    port.send(datum(&world, 0)).unwrap();
    robot.tick();
    assert_eq!(robot.robot.account().status().accepted_of(Input::Assist), 0);
}

/// Before and after it was heard, a leader that says nothing is told apart from one that does.
#[test]
fn a_child_that_hears_nobody_says_so() {
    let world = World::new();
    let mut child = child(&world);
    let port = world.publisher::<Assist>("b");
    pass(&mut [&mut child]);
    let health = |child: &mut Subject| child.tick().health_of(Input::Assist);
    assert_eq!(health(&mut child), Health::NeverSeen);
    port.send(datum(&world, 0)).unwrap();
    assert_eq!(health(&mut child), Health::Ok);
    let mut quiet = (0..500).map(|_| health(&mut child));
    assert!(quiet.any(|it| it == Health::Stale));
}

/// It is seen, is told where it is, and answers nothing.
#[test]
fn a_robot_that_is_seen_and_mute_is_counted() {
    let world = World::new();
    let lines = "[assist]\nleaders = [1]\nchildren = [2, 3]\n[[team]]\nname = \"c\"\nid = 3\n";
    let mut child = world.robot("b", 2, lines);
    let (port, laser) = (
        world.publisher::<Assist>("b"),
        world.publisher::<RelativePose>("b"),
    );
    pass(&mut [&mut child]);
    let seen = RelativePose {
        observed: 3,
        ..sighting(world.header(0))
    };
    laser.send(seen).unwrap();
    port.send(datum(&world, 0)).unwrap();
    (0..10).for_each(|_| {
        child.tick();
    });
    let counted = child.robot.account().status().assist;
    assert_eq!((counted.accepted, counted.forwarded), (1, 1));
    assert_eq!((counted.timed_out, counted.freed_late), (1, 0));
    assert_eq!(counted.mutes, 0, "once is no habit");
    for sequence in 1..=6 {
        (0..12).for_each(|_| {
            child.tick();
        });
        let seen = RelativePose {
            observed: 3,
            ..sighting(world.header(sequence))
        };
        laser.send(seen).unwrap();
        port.send(datum(&world, sequence)).unwrap();
        (0..10).for_each(|_| {
            child.tick();
        });
    }
    let counted = child.robot.account().status().assist;
    assert_eq!((counted.mutes, counted.mute), (1, 3), "{counted:?}");
}

const FULL: &str =
    "[assist]\nleaders = [1, 3]\nchildren = [2]\nmode = \"full\"\n[[team]]\nname = \"c\"\nid = 3\n";

/// As the child says it, of an event that is over.
fn readings(world: &World, sequence: u64) -> Readings {
    let now_ns = world.header(sequence).stamp_ns;
    let slot = now_ns.div_euclid(SLOT_NS) - 1;
    Readings {
        header: Header {
            source: 2,
            session: 77,
            stamp_ns: slot * SLOT_NS + SLOT_NS / 2,
            ..world.header(sequence)
        },
        slot,
        ..Readings::default()
    }
}

#[test]
fn where_leaders_know_all_readings_a_leader_tells_a_final_pose_once_the_event_is_over() {
    let world = World::new();
    let lines = "[initial]\npose = [0.0, 0.0, 0.0]\nsigma = [0.02, 0.02, 0.01]\n";
    let mut leader = world.robot("a", 1, &format!("{FULL}{lines}"));
    let lines = "[initial]\npose = [2.4, 0.0, 0.0]\nsigma = [0.5, 0.5, 0.1]\n";
    let mut child = world.robot("b", 2, &format!("{FULL}{lines}"));
    let laser = world.publisher::<RelativePose>("a");
    pass(&mut [&mut leader, &mut child]);
    laser.send(sighting(world.header(0))).unwrap();
    leader.tick();
    child.tick();
    let status = |it: &Subject| it.robot.account().status();
    assert_eq!(status(&leader).assist.forwarded, 0, "the event goes on");
    for _ in 0..20 {
        leader.tick();
        child.tick();
    }
    let (leader, child) = (status(&leader), status(&child));
    assert_eq!((leader.assist.forwarded, leader.assist.accepted), (1, 0));
    assert_eq!(child.accepted_of(Input::Assist), 1);
    assert_eq!(child.assist.disagreed, 0);
    assert_eq!(leader.rejected_total(Input::AssistAck), 0);
}

/// What makes a word one that is refused, under which input, and why.
type Forged = (fn(&mut Readings), Input, Reject);

#[test]
fn what_is_forged_of_readings_is_refused_under_its_reason() {
    let world = World::new();
    let mut leader = world.robot("a", 1, FULL);
    let port = world.publisher::<Readings>("a");
    pass(&mut [&mut leader]);
    let cases: [Forged; 9] = [
        (
            |it| it.header.source = 9,
            Input::Readings,
            Reject::UnknownRobot,
        ),
        (
            |it| {
                it.count = 17;
                let covariance = diagonal([0.0025, 0.0025, 0.0003]);
                it.sights
                    .iter_mut()
                    .for_each(|it| it.covariance = covariance);
            },
            Input::Readings,
            Reject::Unsupported,
        ),
        (
            |it| (it.count, it.sights[0].observed) = (1, 9),
            Input::Readings,
            Reject::UnknownRobot,
        ),
        (|it| it.trace = 1.0, Input::Readings, Reject::Unsupported),
        (
            |it| (it.count, it.sights[0].pose[0]) = (1, f64::NAN),
            Input::Readings,
            Reject::NotFinite,
        ),
        (
            |it| (it.flags, it.trace) = (Readings::LEADS, 1e-6),
            Input::Assist,
            Reject::NotForRole,
        ),
        (
            |it| (it.count, it.sights[0].observed) = (1, 2),
            Input::Assist,
            Reject::Looped,
        ),
        (
            |it| (it.count, it.sights[0].observed) = (1, 3),
            Input::Assist,
            Reject::NotForRole,
        ),
        (|it| it.slot += 1, Input::Assist, Reject::WrongEvent),
    ];
    for (sequence, (change, input, reason)) in (0..).zip(cases) {
        let before = rejected(&leader, input, reason);
        let mut message = readings(&world, sequence);
        change(&mut message);
        if message.count == 1 {
            message.sights[0].covariance = diagonal([0.0025, 0.0025, 0.0003]);
        }
        port.send(message).unwrap();
        leader.tick();
        assert_eq!(
            rejected(&leader, input, reason),
            before + 1,
            "case {sequence}: {reason:?}"
        );
    }
    assert_eq!(leader.robot.account().status().assist.forwarded, 0);
}

/// A final pose is a leader's alone, and nothing else is one here.
#[test]
fn where_leaders_know_all_readings_a_pose_that_is_not_final_is_forged() {
    let world = World::new();
    let mut child = world.robot("b", 2, FULL);
    let port = world.publisher::<Assist>("b");
    pass(&mut [&mut child]);
    let send = |child: &mut Subject, sequence, flags, digest| {
        let message = Assist {
            flags,
            digest,
            ..datum(&world, sequence)
        };
        port.send(message).unwrap();
        child.tick();
        let status = child.robot.account().status();
        (
            status.rejected_of(Input::Assist, Reject::Unsupported),
            status.assist.accepted,
        )
    };
    assert_eq!(send(&mut child, 0, 0, 0), (1, 0));
    assert_eq!(send(&mut child, 1, 0, 7), (2, 0));
    assert_eq!(send(&mut child, 2, Assist::FINAL, 7), (2, 1));
}

/// What comes is not believed before its time.
#[test]
fn a_child_that_waits_believes_later() {
    let world = World::new();
    let lines = "[assist]\nleaders = [1, 3]\nchildren = [2]\nmode = \"bounded-delayed\"\nmax_delay_ms = 100\n\
                 [[team]]\nname = \"c\"\nid = 3\n\
                 [initial]\npose = [2.4, 0.0, 0.0]\nsigma = [0.5, 0.5, 0.1]\n";
    let mut child = world.robot("b", 2, lines);
    let port = world.publisher::<Assist>("b");
    pass(&mut [&mut child]);
    let mut said = 0;
    let mut say = |child: &mut Subject, leader: u16| {
        let mut message = datum(&world, said);
        (message.header.source, message.path[0]) = (leader, leader);
        said += 1;
        port.send(message).unwrap();
        child.tick()
    };
    // Both are heard once: from then on each is waited for.
    say(&mut child, 3);
    say(&mut child, 1);
    (0..12).for_each(|_| {
        child.tick();
    });
    let before = child.tick().total()[0];
    let waiting = say(&mut child, 1).total()[0];
    assert!(waiting >= before, "{waiting} {before}");
    let accepted = child.robot.account().status().assist.accepted;
    assert_eq!(accepted, 3);
    let later = (0..6).map(|_| child.tick().total()[0]).last().unwrap();
    assert!(later < before, "{later} {before}");
}
