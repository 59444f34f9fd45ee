//! Ticks driven by hand: what the daemon's loop does, to the nanosecond.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod by_hand;

use std::ops::Range;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use by_hand::{METRES_PER_TICK, PERIOD, SECOND, Subject, TestTime, World, diagonal};
use coloc_daemon::clock::{KernelTime, Reading, TimeSource};
use coloc_daemon::config::Config;
use coloc_daemon::event::{Event, Link};
use coloc_daemon::record::Step;
use coloc_daemon::tick::Outcome;
use coloc_daemon::wait::Wake;
use coloc_drivers::can::{Frame, Sender};
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{
    Estimate, Header, Heading, Health, Input, Message, Neighbour, Pose, Position, Publisher,
    Reject, RelativePose,
};

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
fn every_estimate_has_the_next_number_of_one_session() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let estimates: Vec<_> = (0..5).map(|_| robot.tick()).collect();
    for (number, estimate) in (0..).zip(&estimates) {
        let header = &estimate.header;
        assert_eq!((header.sequence, header.source), (number, 1));
        assert_eq!(header.session, estimates[0].header.session);
        assert_eq!(estimate.tick, estimates[0].tick + number);
    }
}

/// Also after the clock of the day was set: the other one runs on.
#[test]
fn an_estimate_says_its_moment_by_both_clocks() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    for step_ns in [0, 3600 * SECOND, -SECOND] {
        world.time.step(step_ns);
        let estimate = robot.tick();
        assert_eq!(estimate.boot_ns, world.time.read_boot());
        assert_eq!(estimate.header.stamp_ns, world.time.realtime());
    }
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
    assert!(after.total()[0] < before.1.total()[0] / 2.0);
    assert!(after.dependent[0] > 0.0, "it owes it to the other one");
    let account = seen.robot.account();
    assert_eq!(account.status().accepted_of(Input::Neighbour), 1);
    assert_eq!(
        seer.robot
            .account()
            .status()
            .accepted_of(Input::RelativePose),
        1
    );
}

fn heading(header: Header) -> Heading {
    Heading {
        header,
        what: Heading::COMPASS,
        quality: 1,
        heading: 0.5,
        variance: 0.01,
        ..Heading::default()
    }
}

fn set(header: Header, pose: [f64; 3]) -> Pose {
    Pose {
        header,
        set: Pose::SET,
        pose,
        covariance: diagonal([0.01, 0.01, 0.001]),
        ..Pose::default()
    }
}

#[test]
fn a_robot_is_where_it_was_told_within_two_seconds() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let persons = world.publisher::<Pose>("a");
    robot.tick();
    persons
        .send(set(world.header(0), [5.0, -2.0, 1.0]))
        .unwrap();
    assert_eq!(robot.tick().health_of(Input::Pose), Health::Ok);
    let estimates: Vec<_> = (0..99).map(|_| robot.tick()).collect();
    let last = estimates.last().unwrap();
    let apart = last.pose.iter().zip([5.0, -2.0, 1.0]);
    assert!(
        apart.map(|(a, b)| (a - b).abs()).all(|it| it < 1e-9),
        "{:?}",
        last.pose
    );
    assert!(last.dependent[0] >= 0.01, "others may know it from there");
    assert_eq!(last.health_of(Input::Pose), Health::Stale, "said once");
    let status = robot.robot.account().status();
    assert_eq!(status.accepted_of(Input::Pose), 1);
    let events = std::iter::from_fn(|| robot.link.next_event());
    let decided = events.filter(|event| {
        let of = (Input::Pose, 0);
        matches!(event, Event::Decided { input, source, .. } if (*input, *source) == of)
    });
    assert_eq!(decided.count(), 1);
}

fn send_bad_headings(world: &World) -> (Publisher<Heading>, u64) {
    let compasses = world.publisher::<Heading>("a");
    let good = heading(world.header(0));
    let bad_headings = [
        Heading { quality: 0, ..good },
        Heading { what: 3, ..good },
        Heading {
            variance: 0.0,
            ..good
        },
        Heading {
            heading: f64::NAN,
            ..good
        },
    ];
    for (heading, sequence) in bad_headings.into_iter().zip(0..) {
        let header = world.header(sequence);
        compasses.send(Heading { header, ..heading }).unwrap();
    }
    (compasses, bad_headings.len() as u64)
}

/// One message of every kind that must change nothing. What a publisher sent is gone with it, so they come back too.
fn send_garbage(world: &World) -> (impl Sized, [u64; 5]) {
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
        header: Header {
            source: 1,
            ..world.header(0)
        },
        dependent: diagonal([1.0; 3]),
        ..Neighbour::default()
    };
    neighbours.send(neighbour).unwrap();
    neighbours
        .send(Neighbour {
            header: Header {
                source: 2,
                ..world.header(0)
            },
            independent: diagonal([2.0; 3]),
            dependent: diagonal([-1.0; 3]),
            ..neighbour
        })
        .unwrap();
    let poses = world.publisher::<Pose>("a");
    let good = set(world.header(0), [9.0; 3]);
    let mut reserved = good;
    reserved.reserved[6] = 1;
    let bad_poses = [
        set(good.header, [0.0, f64::NAN, 0.0]),
        Pose {
            covariance: diagonal([1.0, 1.0, 0.0]),
            ..good
        },
        Pose { set: 2, ..good },
        reserved,
    ];
    for pose in bad_poses {
        poses.send(pose).unwrap();
    }
    let (compasses, bad_headings) = send_bad_headings(world);
    (
        (fixes, sightings, neighbours, poses, compasses),
        [
            bad_fixes.len() as u64,
            1,
            2,
            bad_poses.len() as u64,
            bad_headings,
        ],
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
                    it.total().map(f64::to_bits),
                )
            })
            .collect();
        let status = robot.robot.account().status();
        let inputs = [
            Input::Position,
            Input::RelativePose,
            Input::Neighbour,
            Input::Pose,
            Input::Heading,
        ];
        let rejected = inputs.map(|input| status.rejected_total(input));
        assert_eq!(rejected, expected.unwrap_or_default());
        estimates
    };
    assert_eq!(run(true), run(false));
}

/// A compass turns the belief; the course over ground of a robot that stands says nothing.
#[test]
fn a_heading_turns_the_belief_and_a_course_without_a_way_does_not() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let compasses = world.publisher::<Heading>("a");
    robot.tick();
    compasses.send(heading(world.header(0))).unwrap();
    let gated = robot.tick();
    assert_eq!(
        gated.pose.map(f64::to_bits),
        [0; 3],
        "half a radian off is too much"
    );
    let near = Heading {
        heading: 0.1,
        ..heading(world.header(1))
    };
    compasses.send(near).unwrap();
    let turned = robot.tick();
    assert!((0.005..0.1).contains(&turned.pose[2]), "{:?}", turned.pose);
    assert_eq!(turned.health_of(Input::Heading), Health::Ok);
    let course = Heading {
        what: Heading::COURSE,
        ..heading(world.header(2))
    };
    compasses.send(course).unwrap();
    robot.tick();
    let status = robot.robot.account().status();
    let rejected = |reason| status.rejected_of(Input::Heading, reason);
    assert_eq!(rejected(Reject::NotMoving), 1);
    assert_eq!(rejected(Reject::Gated), 1);
    assert_eq!(status.accepted_of(Input::Heading), 1);
}

/// A compass that begins to speak after a long time is heard within 60 ms, by its stamp; from then on in each tick.
#[test]
fn a_heading_after_a_long_silence_comes_a_little_later() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let compasses = world.publisher::<Heading>("a");
    let accepted = |robot: &Subject| robot.robot.account().status().accepted_of(Input::Heading);
    let near = |sequence| Heading {
        heading: 0.1,
        ..heading(world.header(sequence))
    };
    for _ in 0..100 {
        robot.tick();
    }
    compasses.send(near(0)).unwrap();
    let waited = (1..=10).find(|_| {
        robot.tick();
        accepted(&robot) == 1
    });
    assert!(waited.is_some_and(|ticks| ticks <= 3), "{waited:?} ticks");
    for sequence in 1..10 {
        compasses.send(near(sequence)).unwrap();
        robot.tick();
        assert_eq!(accepted(&robot), sequence + 1);
    }
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
    let status = robot.robot.account().status();
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
                    covariance: [1.0, 0.0, 0.0, 1.0],
                    ..Position::default()
                })
                .unwrap();
        }
        robot.tick();
    }
    let status = robot.robot.account().status();
    assert_eq!(
        status.rejected_of(Input::Position, Reject::BadQuality),
        3200
    );
    assert!(
        status.losses.events > 0,
        "nobody drains the ring of {}",
        Link::CAPACITY
    );
}

/// So many of each kind are taken in at once; the wheels' sample comes on top.
#[test]
fn a_tick_has_room_for_all_that_it_takes_in() {
    let world = World::new();
    let team = |id| format!("[[team]]\nname = \"r{id}\"\nid = {id}\n");
    let team = (1..=17).map(team).collect::<Vec<_>>().concat();
    let text = format!(
        "{team}[robot]\nname = \"r1\"\nid = 1\n[telemetry]\nrecord = \"r1.jsonl\"\n{}",
        world.wheels()
    );
    let config = Config::parse(&text, "tick.toml".as_ref()).unwrap();
    let mut robot = world.robot_of(&config);
    let (mut encoders, mut wheels) = (world.sender(), WheelFrames::new(METRES_PER_TICK));
    let mut send_wheels = || {
        for frame in wheels.encode(0.0, 0.0) {
            encoders.send(&frame).unwrap();
        }
    };
    send_wheels();
    robot.tick();
    robot.recorded_ticks();
    send_wheels();
    let (_lasers, sightings) = crowd(&world, (0..2, 64), |header| RelativePose {
        header,
        observed: 2,
        covariance: diagonal([0.01, 0.01, 0.001]),
        ..RelativePose::default()
    });
    let (_receivers, fixes) = crowd(&world, (0..1, 32), |header| Position {
        header,
        quality: 4,
        covariance: [1.0, 0.0, 0.0, 1.0],
        ..Position::default()
    });
    let (_others, words) = crowd(&world, (2..18, 16), |header| Neighbour {
        header,
        independent: diagonal([0.01, 0.01, 0.001]),
        ..Neighbour::default()
    });
    let (_maps, said) = crowd(&world, (0..1, 16), |header| Pose {
        set: Pose::SAID,
        ..set(header, [0.0; 3])
    });
    let (_compasses, headings) = crowd(&world, (0..1, 64), |header| Heading {
        header,
        quality: 1,
        variance: 0.01,
        ..Heading::default()
    });
    robot.tick();
    let all = sightings + fixes + words + said + headings + 1;
    assert_eq!(robot.recorded_ticks(), [(Step::Own, all)]);
}

/// A publisher of each source, and how many messages they have sent to `r1`: so many each.
fn crowd<M: Message>(
    world: &World,
    (sources, each): (Range<u16>, usize),
    message: impl Fn(Header) -> M,
) -> (Vec<Publisher<M>>, usize) {
    let publishers = sources.map(|source| {
        let publisher = world.publisher("r1");
        for sequence in (0..).take(each) {
            let header = Header {
                source,
                ..world.header(sequence)
            };
            publisher.send(message(header)).unwrap();
        }
        publisher
    });
    let publishers: Vec<_> = publishers.collect();
    let sent = each * publishers.len();
    (publishers, sent)
}

#[test]
fn half_a_sample_is_no_tick() {
    let world = World::new();
    let lines = format!("[tick]\ntrigger = \"encoder\"\n{}", world.wheels());
    let mut robot = world.robot("a", 1, &lines);
    let mut sender = world.sender();
    let mut frames = WheelFrames::new(METRES_PER_TICK);
    let mut wake = |frame| {
        world.time.run(PERIOD / 2);
        sender.send(&frame).unwrap();
        let outcome = robot.robot.wake(Wake::Frame);
        (outcome, robot.robot.account().status().can.frames)
    };
    let [left, right] = frames.encode(0.0, 0.0);
    assert_eq!(
        [wake(left), wake(right)],
        [(Outcome::Incomplete, 1), (Outcome::Incomplete, 2)],
        "counting starts here"
    );
    let [left, right] = frames.encode(0.01, 0.01);
    assert_eq!(
        [wake(left), wake(right)],
        [(Outcome::Incomplete, 3), (Outcome::Ticked, 4)]
    );
    assert_eq!(
        robot.robot.account().status().accepted_of(Input::Odometry),
        1
    );
}

/// Two wheels' frames a quarter of a millisecond apart, messages before them, for a hundred ticks: what the robot says.
fn said_of_frames_apart(rehearse: bool) -> Vec<Estimate> {
    const GAP: i64 = PERIOD / 80;
    let world = World::new();
    let lines = format!("[tick]\ntrigger = \"encoder\"\n{}", world.wheels());
    let mut robot = world.robot("a", 1, &lines);
    let (fixes, neighbours) = (world.publisher("a"), world.publisher("a"));
    let mut sender = world.sender();
    let mut frames = WheelFrames::new(METRES_PER_TICK);
    let mut taken_early = 0;
    let said = (0..100_u32).filter_map(|turn| {
        let way_m = 0.01 * f64::from(turn);
        let [left, right] = frames.encode(way_m, 1.1 * way_m);
        world.time.run(PERIOD - GAP);
        if turn % 5 == 4 {
            let header = world.header(turn.into());
            fixes.send(fix_at(header, [way_m, 0.0])).unwrap();
            neighbours.send(word_of(header, [way_m, 0.1, 0.2])).unwrap();
        }
        sender.send(&left).unwrap();
        assert_eq!(robot.robot.wake(Wake::Frame), Outcome::Incomplete);
        if rehearse {
            robot.robot.prepare();
            taken_early += robot.robot.collect().heard().len();
        }
        world.time.run(GAP);
        sender.send(&right).unwrap();
        let _ = robot.robot.wake(Wake::Frame);
        robot.estimates.receive().unwrap()
    });
    let said: Vec<_> = said.collect();
    assert_eq!(taken_early > 30, rehearse, "{taken_early}");
    let status = robot.robot.account().status();
    let accepted = [Input::Position, Input::Neighbour].map(|it| status.accepted_of(it));
    assert_eq!(accepted, [20, 20]);
    said
}

#[test]
fn a_rehearsal_changes_no_bit_of_what_is_said() {
    let [mut rehearsed, plain] = [true, false].map(said_of_frames_apart);
    assert_eq!(rehearsed.len(), 99, "counting starts with the first");
    for (one, other) in rehearsed.iter_mut().zip(&plain) {
        one.header.session = other.header.session; // A number of each life's own.
    }
    assert_eq!(rehearsed, plain);
}

fn fix_at(header: Header, position: [f64; 2]) -> Position {
    Position {
        header,
        quality: 4,
        position,
        covariance: [0.01, 0.0, 0.0, 0.01],
        ..Position::default()
    }
}

fn word_of(header: Header, pose: [f64; 3]) -> Neighbour {
    Neighbour {
        header: Header {
            source: 2,
            ..header
        },
        pose,
        independent: diagonal([0.01; 3]),
        dependent: diagonal([0.01; 3]),
    }
}

/// The kernel's clocks, and frames that come right after they were read.
struct Interrupted {
    sender: Mutex<Sender>,
    frames: Arc<Mutex<Vec<Frame>>>,
}

impl TimeSource for Interrupted {
    fn read(&self) -> Reading {
        let reading = KernelTime.read();
        for frame in self.frames.lock().unwrap().drain(..) {
            self.sender.lock().unwrap().send(&frame).unwrap();
        }
        reading
    }

    fn now_ns(&self) -> i64 {
        KernelTime.now_ns()
    }
}

#[test]
fn a_frame_that_comes_as_the_clocks_are_read_starts_the_next_tick_at_once() {
    let world = World::new();
    let lines = format!("[tick]\ntrigger = \"encoder\"\n{}", world.wheels());
    let frames = Arc::new(Mutex::new(Vec::new()));
    let time = Interrupted {
        sender: Mutex::new(world.sender()),
        frames: Arc::clone(&frames),
    };
    let mut subject = world.robot_under(Box::new(time), "a", 1, &lines);
    let mut wheels = WheelFrames::new(METRES_PER_TICK);
    let mut wakes_after = |sent: [Frame; 2]| {
        std::thread::sleep(Duration::from_nanos(PERIOD.unsigned_abs())); // By the kernel's stamps, that much apart.
        frames.lock().unwrap().extend(sent);
        [Wake::Frame; 2].map(|wake| subject.robot.wake(wake))
    };
    wakes_after(wheels.encode(0.0, 0.0));
    let outcomes = wakes_after(wheels.encode(0.0, 0.0));
    assert_eq!(outcomes, [Outcome::Incomplete, Outcome::Ticked]);
    let estimate = subject.estimates.receive().unwrap().expect("a tick");
    let timing = subject.timing().expect("a tick tells its time");
    assert_eq!(timing.header.stamp_ns, estimate.header.stamp_ns);
    let stages = [timing.collect_ns, timing.estimate_ns, timing.publish_ns];
    assert!(stages.iter().all(|&ns| ns > 0), "{timing:?}");
    assert!(
        (1..=timing.header.stamp_ns).contains(&timing.frame_stamp_ns) && timing.latency_ns > 0,
        "{timing:?}"
    );
}

/// The test's clock; while there are frames to flood with, each that is taken off the bus lets another one in.
struct Flooded {
    time: TestTime,
    sender: Mutex<Sender>,
    frames: Arc<Mutex<Option<Frame>>>,
}

impl TimeSource for Flooded {
    fn read(&self) -> Reading {
        self.time.read()
    }

    fn of_kernel(&self, stamp_ns: i64) -> i64 {
        if let Some(frame) = *self.frames.lock().unwrap() {
            self.sender.lock().unwrap().send(&frame).unwrap();
        }
        stamp_ns
    }
}

/// A flood of frames leaves no time for a fix that came before it.
#[test]
fn a_tick_that_is_behind_is_recorded_without_what_waits_for_the_next_one() {
    let world = World::new();
    let frames = Arc::new(Mutex::new(None));
    let time = Flooded {
        time: world.time.clone(),
        sender: Mutex::new(world.sender()),
        frames: Arc::clone(&frames),
    };
    let lines = format!("[telemetry]\nrecord = \"a.jsonl\"\n{}", world.wheels());
    let mut subject = world.robot_under(Box::new(time), "a", 1, &lines);
    subject.tick();
    assert_eq!(subject.recorded_ticks(), [(Step::Own, 0)]);
    let fixes = world.publisher::<Position>("a");
    fixes
        .send(Position {
            header: world.header(0),
            quality: 4,
            covariance: [1.0, 0.0, 0.0, 1.0],
            ..Position::default()
        })
        .unwrap();
    assert!(
        (0..16).all(|_| !subject.robot.listen()),
        "there is time for messages"
    );
    let [frame, _] = WheelFrames::new(METRES_PER_TICK).encode(0.0, 0.0);
    let mut sender = world.sender();
    (0..8).for_each(|_| sender.send(&frame).unwrap()); // Fewer would mean that there are no more.
    *frames.lock().unwrap() = Some(frame);
    subject.tick();
    assert_eq!(subject.recorded_ticks(), [(Step::Behind, 0)]);
    *frames.lock().unwrap() = None;
    subject.tick();
    assert_eq!(subject.recorded_ticks(), [(Step::Own, 1)]);
    let status = subject.robot.account().status();
    assert_eq!(status.accepted_of(Input::Position), 1);
}

#[test]
fn a_robot_may_be_opened_and_driven_on_any_thread() {
    let driven = std::thread::spawn(|| {
        let world = World::new();
        world.robot("a", 1, "").tick().tick
    });
    // Joined, so that the world has left shared memory before the process ends.
    assert_eq!(driven.join().unwrap(), 0);
}
