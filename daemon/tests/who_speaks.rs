//! Who speaks on a channel: nobody mutes another, every loss is counted for its source, and a channel that is full is a state.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod by_hand;

use by_hand::{PERIOD, SECOND, Subject, World, diagonal};
use coloc_daemon::event::Event;
use coloc_shm_types::{
    Channel, Clock, Header, Health, Input, Neighbour, Position, Publisher, Reject, RelativePose,
    SourceHealth, Status,
};

/// A fix at the origin.
fn fix(header: Header) -> Position {
    Position {
        header,
        quality: 4,
        covariance: [1.0, 0.0, 0.0, 1.0],
        ..Position::default()
    }
}

/// What robot `b` says to robot `a`: that it is at the origin.
fn word(header: Header) -> Neighbour {
    Neighbour {
        header: Header {
            source: 2,
            ..header
        },
        dependent: diagonal([0.1; 3]),
        ..Neighbour::default()
    }
}

/// What the telemetry thread hears.
#[derive(Default)]
struct Telemetry {
    status: Status,
    contests: usize,
}

impl Telemetry {
    /// Takes in what was said, and gives back what has to be.
    fn listen(&mut self, robot: &Subject) {
        while let Some(event) = robot.link.next_event() {
            match event {
                Event::Account(ledger) => {
                    self.status = ledger.status;
                    robot.link.give_back(ledger);
                }
                Event::Contested { state, .. } if state.contested => self.contests += 1,
                _ => {}
            }
        }
    }

    fn tick(&mut self, robot: &mut Subject) {
        robot.tick();
        self.listen(robot);
    }
}

/// Ticks until the books of the next second are closed.
fn status(robot: &mut Subject) -> Status {
    let mut telemetry = Telemetry::default();
    telemetry.listen(robot);
    for _ in 0..51 {
        telemetry.tick(robot);
    }
    telemetry.status
}

fn row(status: &Status, input: Input, source: u16) -> SourceHealth {
    let mut rows = status.sources();
    let row = rows.find(|(of, row)| (*of, row.source) == (input, source));
    *row.expect("a row").1
}

fn accepted(robot: &Subject, input: Input) -> u64 {
    robot.robot.account().status().accepted_of(input)
}

/// Two receivers on one channel: each is a source, also where stamp and count are the same. One of them used to be muted.
#[test]
fn two_receivers_with_one_stamp_and_one_count_are_two_fixes() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let receivers = [0, 1].map(|_| world.publisher::<Position>("a"));
    robot.tick();
    for sequence in 0..10 {
        for (source, receiver) in (0..).zip(&receivers) {
            let header = Header {
                source,
                ..world.header(sequence)
            };
            receiver.send(fix(header)).unwrap();
        }
        robot.tick();
    }
    let status = status(&mut robot);
    assert_eq!(status.accepted_of(Input::Position), 20);
    assert_eq!(status.rejected_total(Input::Position), 0);
    for source in [0, 1] {
        let row = row(&status, Input::Position, source);
        assert_eq!((row.accepted, row.rejected, row.lost), (10, 0, 0));
        assert!(!row.is_contested());
    }
}

/// A driver that was started again after somebody had set the clock back used to be muted until the clock had caught up.
#[test]
fn a_driver_that_is_restarted_after_the_clock_was_set_back_is_heard_at_once() {
    for step_ns in [-3600 * SECOND, 3600 * SECOND] {
        let world = World::new();
        let mut robot = world.robot("a", 1, "");
        let fixes = world.publisher::<Position>("a");
        robot.tick();
        for (session, sequence) in [(9, 500), (9, 501), (4, 0), (4, 1), (77, 0)] {
            if sequence == 0 {
                world.time.step(step_ns);
                robot.tick();
            }
            let header = Header {
                session,
                ..world.header(sequence)
            };
            fixes.send(fix(header)).unwrap();
            robot.tick();
        }
        assert_eq!(accepted(&robot, Input::Position), 5);
        assert_eq!(
            robot
                .robot
                .account()
                .status()
                .rejected_total(Input::Position),
            0
        );
    }
}

/// One message of a session slightly ahead used to silence the real neighbour for good.
#[test]
fn a_spoofed_message_silences_no_neighbour() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let words = world.publisher::<Neighbour>("a");
    robot.tick();
    let spoofed = [(2, 0), (u64::MAX, u64::MAX), (1, 1_000_000), (1, u64::MAX)];
    for (sequence, spoofed) in (0..40).zip(spoofed.iter().cycle()) {
        let before = accepted(&robot, Input::Neighbour);
        words.send(word(world.header(sequence))).unwrap();
        robot.tick();
        assert_eq!(accepted(&robot, Input::Neighbour), before + 1, "{sequence}");
        let header = Header {
            session: spoofed.0,
            ..world.header(spoofed.1)
        };
        words.send(word(header)).unwrap();
        robot.tick();
    }
}

#[test]
fn two_senders_that_claim_one_source_are_heard_shown_and_said_once() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let fixes = world.publisher::<Position>("a");
    let (mut telemetry, count) = (Telemetry::default(), 4 * 25);
    telemetry.tick(&mut robot);
    for sequence in 0..count {
        for session in [3, 8] {
            let header = Header {
                session,
                ..world.header(sequence)
            };
            fixes.send(fix(header)).unwrap();
            telemetry.tick(&mut robot);
        }
    }
    let found = row(&telemetry.status, Input::Position, 0);
    assert!(found.is_contested(), "{found:?}");
    assert_eq!(found.live_sessions, 2);
    assert_eq!(accepted(&robot, Input::Position), 2 * count);
    assert_eq!(telemetry.contests, 1);
    for sequence in count..count + 300 {
        let header = Header {
            session: 3,
            ..world.header(sequence)
        };
        fixes.send(fix(header)).unwrap();
        telemetry.tick(&mut robot);
    }
    let found = row(&telemetry.status, Input::Position, 0);
    assert!(!found.is_contested(), "one of them has ended: {found:?}");
    assert_eq!(found.live_sessions, 1);
}

/// The row used to say for ever that two claim a source, if that was forgotten for another one before its end was seen.
#[test]
fn a_contest_ends_also_when_its_source_gives_way_to_another_one() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let fixes = world.publisher::<Position>("a");
    let mut telemetry = Telemetry::default();
    let mut contested = Vec::new();
    for tick in 0..=300_u64 {
        if tick <= 225 {
            let header = Header {
                session: 3 + tick % 2,
                ..world.header(tick / 2)
            };
            fixes.send(fix(header)).unwrap();
        }
        // After a second the two have ended; there is room for fifteen beside them.
        for source in (1..=16).filter(|_| tick == 280) {
            let header = Header {
                source,
                ..world.header(0)
            };
            fixes.send(fix(header)).unwrap();
        }
        telemetry.tick(&mut robot);
        if tick % 50 == 0 && tick >= 250 {
            let found = row(&telemetry.status, Input::Position, 0);
            contested.push((found.is_contested(), found.live_sessions));
        }
    }
    let too_many = telemetry
        .status
        .rejected_of(Input::Position, Reject::TooManySources);
    assert_eq!(too_many, 0, "it gave way");
    assert_eq!(contested, [(true, 2), (false, 0)]);
}

/// What a channel had no room for used to be lost without a word.
#[test]
fn what_a_fast_receiver_loses_is_counted_to_the_last() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let fixes = world.publisher::<Position>("a");
    robot.tick();
    let (mut sent, burst) = (0, 100);
    for _ in 0..10 {
        for _ in 0..burst {
            let header = Header {
                stamp_ns: world.time.realtime() - i64::try_from(sent).unwrap(),
                ..world.header(sent)
            };
            fixes.send(fix(header)).unwrap();
            sent += 1;
        }
        for _ in 0..5 {
            robot.tick();
        }
    }
    let room = Channel::Position.quality().buffer as u64;
    let status = status(&mut robot);
    let found = row(&status, Input::Position, 0);
    assert_eq!(
        found.lost,
        9 * (burst - room),
        "the first burst began the count"
    );
    let known = found.accepted + found.rejected + found.lost;
    assert_eq!(known + (burst - room), sent);
    assert_eq!(found.rejected, status.rejected_total(Input::Position));
}

/// At 1 kHz a tick takes all that has come; used to be 1,069 of 5,000 that were lost uncounted.
#[test]
fn a_receiver_of_a_kilohertz_loses_nothing() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "[history]\ncapacity = 2048\n");
    let fixes = world.publisher::<Position>("a");
    robot.tick();
    let mut sequence = 0;
    for _ in 0..250 {
        for back in (0..20).rev() {
            let header = Header {
                stamp_ns: world.time.realtime() - back * SECOND / 1000,
                ..world.header(sequence)
            };
            fixes.send(fix(header)).unwrap();
            sequence += 1;
        }
        robot.tick();
    }
    let found = row(&status(&mut robot), Input::Position, 0);
    assert_eq!((found.accepted, found.rejected, found.lost), (5000, 0, 0));
}

/// A flood of messages that are refused must not make a tick longer than a flood of good ones.
#[test]
fn refused_messages_count_against_the_limit_of_a_tick() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let fixes = world.publisher::<Position>("a");
    robot.tick();
    for sequence in 0..64 {
        let mut bad = fix(world.header(sequence));
        bad.position = [f64::NAN; 2];
        fixes.send(bad).unwrap();
    }
    let refused = |robot: &Subject| {
        let status = &robot.robot.account().status();
        status.rejected_of(Input::Position, Reject::NotFinite)
    };
    for expected in [32, 64, 64] {
        robot.tick();
        assert_eq!(refused(&robot), expected);
    }
}

#[test]
fn a_clock_that_cannot_be_asked_is_refused_and_every_other_is_read() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let fixes = world.publisher::<Position>("a");
    robot.tick();
    let boot_ns = world.time.read_boot();
    for (clock, stamp_ns, boot) in [
        (Clock::Realtime as u8, world.time.realtime(), 0),
        (Clock::Tai as u8, world.time.realtime(), 0),
        (Clock::Boottime as u8, boot_ns, coloc_shm_types::boot()),
        (Clock::Boottime as u8, boot_ns, 1),
        (9, world.time.realtime(), 0),
    ] {
        let header = Header {
            stamp_ns,
            clock,
            boot,
            source: u16::from(clock),
            ..world.header(u64::from(clock) + boot)
        };
        fixes.send(fix(header)).unwrap();
    }
    robot.tick();
    let status = &robot.robot.account().status();
    let refused = |reason| status.rejected_of(Input::Position, reason);
    assert_eq!(status.accepted_of(Input::Position), 3);
    assert_eq!(
        [Reject::ForeignClock, Reject::UnknownClock].map(refused),
        [1, 1]
    );
}

fn crowd<T: coloc_shm_types::Message>(world: &World, robot: &str) -> Vec<Publisher<T>> {
    let places = T::CHANNEL.quality().publishers;
    (0..places).map(|_| world.publisher(robot)).collect()
}

/// So many publishers on one robot's channel used to keep every other robot from starting.
#[test]
fn a_robot_starts_though_a_neighbours_channel_has_no_place_for_it() {
    let world = World::new();
    let _crowd = crowd::<Neighbour>(&world, "b");
    let mut robot = world.robot("a", 1, "");
    let sightings = world.publisher::<RelativePose>("a");
    robot.tick();
    sightings
        .send(RelativePose {
            header: world.header(0),
            observed: 2,
            covariance: diagonal([0.01; 3]),
            ..RelativePose::default()
        })
        .unwrap();
    let status = status(&mut robot);
    let found = row(&status, Input::Neighbour, 2);
    assert!(found.is_unreachable() && found.health() == Health::NeverSeen);
    assert_eq!(status.losses.undelivered, 1, "the pose of b");
    assert_eq!(status.health_of(Input::Neighbour), Health::NeverSeen);
}

#[test]
fn a_channel_of_its_own_that_has_no_place_for_it_is_faulty() {
    let world = World::new();
    let places = Channel::Position.quality().subscribers;
    let name = by_hand::name("a");
    let _crowd: Vec<_> = (0..places)
        .map(|_| world.space.subscriber::<Position>(&name).unwrap())
        .collect();
    let mut robot = world.robot("a", 1, "");
    let estimate = robot.tick();
    assert_eq!(estimate.health_of(Input::Position), Health::Faulty);
    assert_eq!(estimate.health_of(Input::RelativePose), Health::NeverSeen);
    let fixes = world.publisher::<Position>("a");
    fixes.send(fix(world.header(0))).unwrap();
    world.time.run(PERIOD);
    robot.tick();
    assert_eq!(accepted(&robot, Input::Position), 0);
}
