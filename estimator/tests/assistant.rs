//! A leader, a child that it sees, and a child that only that one sees: through the step that robots with a part in a team go through.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use coloc_estimator::assist::assistant::{
    Ack, Agreement, Assistant, Counts, Heard, Message, Told, Words, step,
};
use coloc_estimator::assist::datum::{Reading, joined, reversed};
use coloc_estimator::assist::refusal::Refusal;
use coloc_estimator::assist::search::Patience;
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, Kind, LeaderPose, Measurement, Motion,
    NeighbourPose, OdometrySample, Origin, Parts, Pose, Propagation, RobotId, Settings, Sighting,
    Slot, Span, Stamp, TickInputs, Verdict,
};

const TICK: Span = Span::from_millis(20);
const LEADER: usize = 0;
const RELAY: usize = 1;
const FAR: usize = 2;
/// Whom each sees.
const SIGHTS: [(usize, usize); 5] = [
    (LEADER, RELAY),
    (RELAY, FAR),
    (RELAY, LEADER),
    (FAR, RELAY),
    (FAR, LEADER),
];

fn id(robot: usize) -> RobotId {
    RobotId(u16::try_from(robot + 1).unwrap())
}

fn at(tick: i64) -> Stamp {
    Stamp::from_nanos(1_000_000_000 + tick * TICK.as_nanos())
}

fn agreement() -> Agreement {
    let patience = Patience {
        ack_timeout: 160,
        close_after: 400,
    };
    let (leaders, children) = ([id(LEADER)], [id(RELAY), id(FAR)]);
    Agreement::new(&leaders, &children, Span::from_millis(200), patience).unwrap()
}

fn truth(robot: usize, tick: i64) -> Pose {
    let [robot, tick] = [i64::try_from(robot).unwrap(), tick].map(|it| i32::try_from(it).unwrap());
    Pose::new(
        3.0 * f64::from(robot) + 0.006 * f64::from(tick),
        f64::from(robot),
        0.0,
    )
}

fn odometry(tick: i64) -> Measurement {
    Measurement::from(OdometrySample {
        source: 0,
        start: at(tick - 1),
        stamp: at(tick),
        motion: Motion::Nonholonomic {
            velocity: [0.3, 0.0],
            noise: Covariance2::diagonal([0.01, 0.01]).unwrap(),
        },
    })
}

fn sighting(observer: usize, observed: usize, tick: i64) -> Measurement {
    let [from, to] = [observer, observed].map(|it| truth(it, tick));
    Measurement::from(Sighting {
        stamp: at(tick),
        origin: Origin::counted(u64::try_from(tick).unwrap() * 8 + observed as u64),
        observed: id(observed),
        relative: Pose::new(to.x - from.x, to.y - from.y, to.phi - from.phi),
        covariance: Covariance3::diagonal([0.0025, 0.0025, 0.0003]).unwrap(),
    })
}

struct Robot {
    estimator: Box<Estimator<Vec<coloc_estimator::Slot>>>,
    assistant: Box<Assistant>,
    data: Vec<Heard>,
    acks: Vec<Ack>,
    sent: u64,
    told: Vec<Told>,
    verdicts: Vec<(Kind, Verdict)>,
}

impl Robot {
    fn new(robot: usize, error_m: f64) -> Self {
        let sigma = if robot == LEADER { 1e-4 } else { 0.25 };
        let truth = truth(robot, 0);
        let pose = Pose::new(truth.x + error_m, truth.y - error_m, truth.phi);
        let covariance = Covariance3::diagonal([sigma, sigma, 1e-4]).unwrap();
        let belief = Belief::independent(pose, covariance);
        let storage = vec![Slot::default(); 256];
        Self {
            estimator: Box::new(Estimator::new(Settings::default(), at(0), belief, storage)),
            assistant: Box::new(Assistant::new(agreement(), id(robot)).unwrap()),
            data: Vec::new(),
            acks: Vec::new(),
            sent: 0,
            told: Vec::new(),
            verdicts: Vec::new(),
        }
    }

    /// What it says to others.
    fn tick(&mut self, tick: i64, measurements: &[Measurement]) -> (Vec<Told>, Vec<Ack>) {
        let (data, acks) = (
            std::mem::take(&mut self.data),
            std::mem::take(&mut self.acks),
        );
        let inputs = TickInputs {
            stamp: at(tick),
            measurements,
        };
        let words = Words {
            ahead: Span::ZERO,
            data: &data,
            acks: &acks,
            ..Words::default()
        };
        let (outputs, carried) = step(&mut self.estimator, &mut self.assistant, &inputs, &words);
        assert_eq!((outputs.overflowed, outputs.outgoing.len()), (0, 0));
        let reports = outputs.reports.iter();
        self.verdicts
            .extend(reports.map(|it| (it.source.kind, it.verdict)));
        // Sightings serve the search.
        self.verdicts
            .retain(|it| *it != (Kind::Sighting, Verdict::Heard));
        self.told.extend_from_slice(carried.data);
        (carried.data.to_vec(), carried.acks.to_vec())
    }

    fn belief(&self, tick: i64) -> Belief {
        self.estimator.belief_at(at(tick)).unwrap()
    }

    fn counts(&self) -> Counts {
        self.assistant.counts()
    }
}

/// Drives the team; a message is there at the next tick. `relay_m` is how far off the relay believes to be.
fn drive(ticks: i64, relay_m: f64) -> [Robot; 3] {
    let mut robots = [(LEADER, 0.0), (RELAY, relay_m), (FAR, 0.3)]
        .map(|(robot, error_m)| Robot::new(robot, error_m));
    for tick in 1..=ticks {
        let mut said = Vec::new();
        for (robot, own) in robots.iter_mut().enumerate() {
            let mut measurements = vec![odometry(tick)];
            if tick % 10 == 2 {
                let seen = SIGHTS.iter().filter(|(observer, _)| *observer == robot);
                measurements.extend(seen.map(|(_, observed)| sighting(robot, *observed, tick)));
            }
            said.push(own.tick(tick, &measurements));
        }
        for (robot, (told, acks)) in said.into_iter().enumerate() {
            deliver(&mut robots, robot, &told, &acks);
        }
    }
    robots
}

fn deliver(robots: &mut [Robot; 3], from: usize, told: &[Told], acks: &[Ack]) {
    for told in told {
        robots[from].sent += 1;
        let origin = Origin {
            source: id(from).0,
            session: 7,
            sequence: robots[from].sent,
        };
        let message = told.message;
        robots[usize::from(told.to.0) - 1]
            .data
            .push(Heard { origin, message });
    }
    for ack in acks {
        robots[usize::from(ack.robot.0) - 1].acks.push(Ack {
            robot: id(from),
            ..*ack
        });
    }
}

fn message_bits(message: &Message) -> Vec<u64> {
    let Pose { x, y, phi } = message.said.pose;
    let parts = &message.said.parts;
    let leader = &message.word.leader;
    let numbers = [x, y, phi, leader.pose.x, leader.pose.y, leader.pose.phi];
    let covariances = [parts.independent, parts.dependent, leader.covariance];
    let all = covariances.into_iter().flat_map(|it| it.to_row_major());
    numbers.into_iter().chain(all).map(f64::to_bits).collect()
}

#[test]
fn a_child_that_no_leader_sees_is_carried_by_one_that_is() {
    const TICKS: i64 = 100;
    let robots = drive(TICKS, 0.3);
    for robot in [RELAY, FAR] {
        let (belief, truth) = (robots[robot].belief(TICKS), truth(robot, TICKS));
        let error = (belief.pose.x - truth.x).hypot(belief.pose.y - truth.y);
        let [xx, yy, _] = belief.total().variances();
        assert!(
            error < 0.1 && xx.max(yy) < 0.02,
            "{robot}: {error}, {belief:?}"
        );
    }
    let [leader, relay, far] = robots.each_ref().map(Robot::counts);
    assert_eq!((leader.forwarded, leader.accepted), (10, 0));
    // The event in which it began is over for a child.
    assert_eq!((relay.accepted, relay.declined), (9, 1));
    assert_eq!((relay.forwarded, relay.timed_out), (9, 0));
    // It does not send back to where a datum comes from.
    assert_eq!((far.accepted, far.forwarded), (9, 0));
    for robot in &robots {
        let fused = robot.verdicts.iter();
        assert!(
            fused.clone().all(|(kind, it)| {
                *kind == Kind::Assist && matches!(it, Verdict::Accepted { .. })
            })
        );
        assert_eq!(fused.count() as u64, robot.counts().accepted);
    }
}

/// Its own belief is no part of what it hands on.
#[test]
fn a_relay_that_believes_garbage_hands_on_the_same_bits() {
    let [good, bad] = [0.3, 4000.0].map(|error_m| drive(60, error_m));
    assert!((bad[RELAY].belief(60).pose.x - truth(RELAY, 60).x).abs() > 100.0);
    let bits = |robots: &[Robot; 3]| {
        let told = robots[RELAY].told.iter();
        told.map(|it| message_bits(&it.message)).collect::<Vec<_>>()
    };
    assert_eq!(bits(&good).len(), 5);
    assert_eq!(bits(&good), bits(&bad));
    let far = |robots: &[Robot; 3]| robots[FAR].belief(60);
    assert_eq!(far(&good), far(&bad));
}

/// What was taken is a measurement as any other: whoever hears all of it in another order, and late, believes the same bits.
#[test]
fn the_belief_is_a_function_of_the_set_of_what_was_taken() {
    const TICKS: i64 = 40;
    let robots = drive(TICKS, 0.3);
    let mut all: Vec<Measurement> = robots[RELAY]
        .told
        .iter()
        .map(|it| {
            let Message {
                stamp, slot, said, ..
            } = it.message;
            LeaderPose {
                stamp,
                leader: it.message.leader(),
                slot,
                said,
            }
            .into()
        })
        .collect();
    assert_eq!(all.len(), 3);
    all.extend((1..=TICKS).map(odometry));
    all.reverse();
    let mut other = Robot::new(FAR, 0.3);
    for (tick, some) in (TICKS - 4..=TICKS).zip(all.chunks(all.len().div_ceil(5))) {
        let inputs = TickInputs {
            stamp: at(tick),
            measurements: some,
        };
        coloc_estimator::step(&mut other.estimator, &inputs);
    }
    assert_eq!(other.belief(TICKS), robots[FAR].belief(TICKS));
}

/// The relay sees later than the leader, or earlier: it carries the datum there by its own wheels, and none of their noise is news.
#[test]
fn a_datum_is_carried_to_the_stamp_of_the_sighting_that_takes_it_further() {
    for seen_at in [10, 14] {
        let mut relay = Robot::new(RELAY, 0.3);
        let mut leader = Robot::new(LEADER, 0.0);
        let mut out = Vec::new();
        for tick in 1..=16 {
            let seen = |now: i64, observer, observed| {
                (tick == now).then(|| sighting(observer, observed, tick))
            };
            let first = [odometry(tick)].into_iter().chain(seen(12, LEADER, RELAY));
            let (told, _) = leader.tick(tick, &first.collect::<Vec<_>>());
            let more = [odometry(tick)]
                .into_iter()
                .chain(seen(seen_at, RELAY, FAR));
            out.extend(relay.tick(tick, &more.collect::<Vec<_>>()).0);
            relay.data.extend(told.iter().map(|told| Heard {
                origin: Origin {
                    source: 1,
                    ..Origin::counted(1)
                },
                message: told.message,
            }));
        }
        let [told] = out.as_slice() else {
            panic!("{out:?}");
        };
        let (said, truth) = (&told.message.said, truth(FAR, seen_at));
        assert_eq!((told.message.stamp, told.to), (at(seen_at), id(FAR)));
        let error = (said.pose.x - truth.x).hypot(said.pose.y - truth.y);
        assert!(error < 1e-3, "{said:?}");
        // Two sightings are news, the leader's error and the way are none.
        let [xx, ..] = said.parts.independent.variances();
        assert!((0.005..0.009).contains(&xx), "{xx}");
    }
}

#[test]
fn a_way_gone_back_twice_is_the_way() {
    let way = Reading {
        relative: Pose::new(0.3, -0.2, 0.7),
        covariance: Covariance3::from_row_major([
            0.04, 0.01, 0.002, 0.01, 0.09, -0.003, 0.002, -0.003, 0.01,
        ])
        .unwrap(),
    };
    let [back, again] = [reversed(&way), reversed(&reversed(&way))];
    let there = joined(&way, &back, Propagation::Honest).relative;
    let exact = Reading {
        covariance: Covariance3::ZERO,
        ..way
    };
    let home = joined(&exact, &reversed(&exact), Propagation::Honest).relative;
    assert!(there.phi.abs() < 1e-15 && home.x.hypot(home.y) < 1e-15);
    let off = (again.covariance.matrix() - way.covariance.matrix()).abs();
    assert!(off.max() < 1e-15, "{off}");
    assert!((again.relative.x - 0.3).abs() < 1e-15 && (again.relative.y + 0.2).abs() < 1e-15);
}

#[test]
fn what_is_not_for_it_is_refused_under_its_reason_and_changes_nothing() {
    let robots = drive(21, 0.3);
    let first = robots[LEADER].told[1].message;
    let forged = |change: &dyn Fn(&mut Message)| {
        let mut message = first;
        change(&mut message);
        message
    };
    let path = |message: &mut Message, ids: &[u16]| {
        for (place, id) in message.path.iter_mut().zip(ids) {
            *place = RobotId(*id);
        }
        message.robots = u8::try_from(ids.len()).unwrap();
    };
    let cases = [
        (forged(&|it| path(it, &[2, 2])), Refusal::NotALeader),
        (forged(&|it| path(it, &[1, 9, 2])), Refusal::UnknownRobot),
        (forged(&|it| path(it, &[1, 3])), Refusal::NotForMe),
        (forged(&|it| path(it, &[1])), Refusal::PathTooShort),
        (
            forged(&|it| it.slot = coloc_estimator::assist::slot::Slot(3)),
            Refusal::WrongEvent,
        ),
        (forged(&|it| it.is_final = true), Refusal::NotFinal),
    ];
    for (message, expected) in cases {
        let mut relay = Robot::new(RELAY, 0.3);
        relay.tick(13, &[]);
        let before = relay.belief(13);
        relay.data.push(Heard {
            origin: Origin {
                source: 1,
                session: 7,
                sequence: 1,
            },
            message,
        });
        let (told, acks) = relay.tick(13, &[]);
        assert_eq!((told.len(), acks.len()), (0, 0));
        assert_eq!(relay.verdicts, [(Kind::Assist, Verdict::Refused(expected))]);
        assert_eq!(
            (relay.counts(), relay.belief(13)),
            (Counts::default(), before)
        );
    }
}

/// Whoever sent it may use its sighting for another leader.
#[test]
fn a_loop_is_refused_with_a_no() {
    let robots = drive(21, 0.3);
    let mut message = robots[LEADER].told[1].message;
    for (place, id) in message.path.iter_mut().zip([1, 2, 3, 2]) {
        *place = RobotId(id);
    }
    message.robots = 4;
    let mut relay = Robot::new(RELAY, 0.3);
    relay.tick(13, &[]);
    let origin = Origin {
        source: 3,
        session: 7,
        sequence: 1,
    };
    relay.data.push(Heard { origin, message });
    let (_, acks) = relay.tick(13, &[]);
    assert_eq!(
        relay.verdicts,
        [(Kind::Assist, Verdict::Refused(Refusal::Looped))]
    );
    let no = Ack {
        robot: id(FAR),
        slot: message.slot,
        stamp: message.stamp,
        leader: id(LEADER),
        taken: false,
    };
    assert_eq!(acks, [no]);
}

/// What a child believes has the leader's error in it.
#[test]
fn a_leader_takes_nothing_from_children() {
    let mut leader = Robot::new(LEADER, 0.0);
    let word = Measurement::from(NeighbourPose {
        stamp: at(3),
        origin: Origin {
            source: id(RELAY).0,
            ..Origin::counted(1)
        },
        pose: Pose::default(),
        parts: Parts::independent(Covariance3::diagonal([0.01; 3]).unwrap()),
    });
    leader.tick(3, &[odometry(1), odometry(2), odometry(3), word]);
    let refused = Verdict::Refused(Refusal::NotForRole);
    assert_eq!(leader.verdicts, [(Kind::Neighbour, refused)]);
}
