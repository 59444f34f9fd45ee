//! Leaders that know all readings: two of them and three children, through the step that robots with a part in a team go through.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use std::collections::BTreeSet;

use coloc_estimator::assist::assistant::{Agreement, Assistant, Counts, Heard, Told, Words, step};
use coloc_estimator::assist::datum::Reading;
use coloc_estimator::assist::readings::{HeardReadings, Readings};
use coloc_estimator::assist::refusal::Refusal;
use coloc_estimator::assist::search::Patience;
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, Kind, Measurement, Motion, OdometrySample, Origin,
    Pose, RobotId, Settings, Sighting, Span, Stamp, TickInputs, Verdict,
};

const TICK: Span = Span::from_millis(20);
/// Ticks of an event, and from its end until leaders work it out.
const EVENT: i64 = 10;
const DEADLINE: i64 = 8;
const ROBOTS: usize = 5;
const LEADERS: usize = 2;
/// Whom each sees. The leaders are 0 and 1; both want 2 → 4, which the surer one gets, and no leader sees 4.
const SIGHTS: [(usize, usize); 7] = [(0, 2), (1, 2), (1, 3), (2, 4), (3, 4), (4, 3), (4, 2)];

fn id(robot: usize) -> RobotId {
    RobotId(u16::try_from(robot + 1).unwrap())
}

fn index(id: RobotId) -> usize {
    usize::from(id.0) - 1
}

fn at(tick: i64) -> Stamp {
    Stamp::from_nanos(2_000_000_000 + tick * TICK.as_nanos())
}

fn agreement() -> Agreement {
    let patience = Patience {
        ack_timeout: 160,
        close_after: 520,
    };
    let ids: Vec<_> = (0..ROBOTS).map(id).collect();
    let (leaders, children) = ids.split_at(LEADERS);
    let period = Span::from_nanos(EVENT * TICK.as_nanos());
    Agreement {
        readings_deadline: Some(Span::from_nanos(DEADLINE * TICK.as_nanos())),
        ..Agreement::new(leaders, children, period, patience).unwrap()
    }
}

/// All go round in circles at 0.5 m/s.
fn truth(robot: usize, tick: i64) -> Pose {
    let [robot, tick] = [i64::try_from(robot).unwrap(), tick].map(|it| i32::try_from(it).unwrap());
    let phi = 0.01 * f64::from(tick) + 0.3 * f64::from(robot);
    let (sin, cos) = phi.sin_cos();
    Pose::new(f64::from(robot) + sin, 0.5 * f64::from(robot) - cos, phi)
}

fn odometry(tick: i64) -> Measurement {
    Measurement::from(OdometrySample {
        source: 0,
        start: at(tick - 1),
        stamp: at(tick),
        motion: Motion::Nonholonomic {
            velocity: [0.5, 0.5],
            noise: Covariance2::diagonal([1e-4, 1e-4]).unwrap(),
        },
    })
}

fn seen(observer: usize, observed: usize, tick: i64) -> Reading {
    let [from, to] = [observer, observed].map(|it| truth(it, tick));
    let (sin, cos) = from.phi.sin_cos();
    let (x, y) = (to.x - from.x, to.y - from.y);
    Reading {
        relative: Pose::new(cos * x + sin * y, cos * y - sin * x, to.phi - from.phi),
        covariance: Covariance3::diagonal([0.0025, 0.0025, 0.0003]).unwrap(),
    }
}

/// Each pair at another tick of each event.
fn sightings(robot: usize, tick: i64) -> impl Iterator<Item = Measurement> {
    let of = SIGHTS.into_iter().zip([1, 4, 7, 3, 8, 2, 6]);
    of.filter(move |((observer, _), when)| *observer == robot && tick % EVENT == *when)
        .map(move |((_, observed), when)| {
            let Reading {
                relative,
                covariance,
            } = seen(robot, observed, tick);
            Measurement::from(Sighting {
                stamp: at(tick),
                origin: Origin::counted(u64::try_from(tick * 16 + when).unwrap()),
                observed: id(observed),
                relative,
                covariance,
            })
        })
}

struct Robot {
    estimator: Box<Estimator<Vec<coloc_estimator::Slot>>>,
    assistant: Box<Assistant>,
    data: Vec<Heard>,
    readings: Vec<HeardReadings>,
    told: Vec<Told>,
    sent: u64,
    verdicts: Vec<(Kind, Verdict)>,
}

impl Robot {
    fn new(robot: usize) -> Self {
        // The second leader is surer than the first.
        let sigma = [2e-4, 1e-4, 0.25, 0.25, 0.25][robot];
        let off = if robot < LEADERS { 0.0 } else { 0.4 };
        let truth = truth(robot, 0);
        let pose = Pose::new(truth.x + off, truth.y - off, truth.phi);
        let covariance = Covariance3::diagonal([sigma, sigma, 1e-4]).unwrap();
        let belief = Belief::independent(pose, covariance);
        let storage = vec![coloc_estimator::Slot::default(); 512];
        Self {
            estimator: Box::new(Estimator::new(Settings::default(), at(0), belief, storage)),
            assistant: Box::new(Assistant::new(agreement(), id(robot)).unwrap()),
            data: Vec::new(),
            readings: Vec::new(),
            told: Vec::new(),
            sent: 0,
            verdicts: Vec::new(),
        }
    }

    fn tick(&mut self, robot: usize, tick: i64) -> (Vec<Told>, Vec<Readings>) {
        let (data, readings) = (
            std::mem::take(&mut self.data),
            std::mem::take(&mut self.readings),
        );
        let mut measurements: Vec<_> = sightings(robot, tick).collect();
        measurements.push(odometry(tick));
        let inputs = TickInputs {
            stamp: at(tick),
            measurements: &measurements,
        };
        let words = Words {
            data: &data,
            readings: &readings,
            ..Words::default()
        };
        let (outputs, carried) = step(&mut self.estimator, &mut self.assistant, &inputs, &words);
        assert_eq!(outputs.overflowed, 0);
        assert!(carried.acks.is_empty(), "a final datum is not answered");
        let reports = outputs.reports.iter();
        let refused = reports.map(|it| (it.source.kind, it.verdict));
        self.verdicts.extend(refused.filter(|it| {
            it.0 == Kind::Assist && !matches!(it.1, Verdict::Accepted { .. } | Verdict::Heard)
        }));
        self.told.extend_from_slice(carried.data);
        (carried.data.to_vec(), carried.readings.to_vec())
    }

    fn origin(&mut self, robot: usize) -> Origin {
        self.sent += 1;
        Origin {
            source: id(robot).0,
            session: 1,
            sequence: self.sent,
        }
    }
}

/// A tick of all, in which `passed` says what a leader hears of what somebody tells it.
fn drive(
    robots: &mut [Robot],
    tick: i64,
    passed: impl Fn(&HeardReadings, usize) -> Vec<HeardReadings>,
) {
    for robot in 0..ROBOTS {
        let (data, readings) = robots[robot].tick(robot, tick);
        for told in data {
            let origin = robots[robot].origin(robot);
            let message = told.message;
            robots[index(told.to)].data.push(Heard { origin, message });
        }
        for readings in readings {
            for leader in (0..LEADERS).filter(|it| *it != robot) {
                let origin = robots[robot].origin(robot);
                let heard = HeardReadings { origin, readings };
                robots[leader].readings.extend(passed(&heard, leader));
            }
        }
    }
}

fn run(events: i64, is_lost: impl Fn(u16, usize) -> bool) -> Vec<Robot> {
    let mut robots: Vec<_> = (0..ROBOTS).map(Robot::new).collect();
    for tick in 1..=events * EVENT {
        drive(&mut robots, tick, |heard, leader| {
            let is_lost = is_lost(heard.origin.source, leader);
            (!is_lost).then_some(*heard).into_iter().collect()
        });
    }
    robots
}

fn ways(robots: &[Robot], slot: i64) -> BTreeSet<Vec<u16>> {
    let all = robots.iter().flat_map(|it| &it.told);
    let of = all.filter(|it| it.message.slot.0 == slot);
    of.map(|it| it.message.robots().iter().map(|id| id.0).collect())
        .collect()
}

/// From the first event that no robot began in.
const FIRST: i64 = 11;

#[test]
fn each_leader_reaches_its_tree_and_no_reading_is_in_two() {
    let robots = run(30, |_, _| false);
    // 2 is surer: it has the turn at what 3 sees of 5, and then 1 comes no further.
    let expected = [vec![1, 3], vec![2, 3], vec![2, 4], vec![2, 3, 5]];
    for slot in FIRST..FIRST + 15 {
        assert_eq!(ways(&robots, slot), BTreeSet::from(expected.clone()));
    }
    for it in &robots {
        assert_eq!(it.verdicts, [], "nothing is refused");
        assert_eq!(it.assistant.counts().disagreed, 0);
    }
    for (robot, it) in robots.iter().enumerate().skip(LEADERS) {
        let (belief, truth) = (it.estimator.belief_at(at(300)).unwrap(), truth(robot, 300));
        let off = (belief.pose.x - truth.x).hypot(belief.pose.y - truth.y);
        assert!(off < 0.02, "robot {robot}: {off}");
        assert!(it.assistant.counts().accepted > 25);
    }
}

/// The first leader never hears the second: both take what 3 sees of 5, and 5 hears both.
#[test]
fn leaders_that_know_different_things_are_counted_and_no_reading_is_used_twice_by_a_child() {
    let robots = run(30, |from, to| from == 2 && to == 0);
    let by_both = ways(&robots, FIRST);
    assert!(by_both.contains(&vec![1, 3, 5]) && by_both.contains(&vec![2, 3, 5]));
    let [.., fifth] = &robots[..] else {
        panic!("five robots");
    };
    let Counts {
        accepted,
        declined,
        disagreed,
        ..
    } = fifth.assistant.counts();
    // Of each event one is taken, and the other one is not.
    assert!(accepted >= 27 && disagreed >= 26, "{accepted} {disagreed}");
    assert!(declined.abs_diff(disagreed) <= 2, "{declined} {disagreed}");
    // What comes to 3 of both shares no sighting.
    let third = robots[2].assistant.counts();
    assert!(third.accepted > 50 && third.disagreed > 25, "{third:?}");
    for (robot, it) in robots.iter().enumerate().skip(LEADERS) {
        let (belief, truth) = (it.estimator.belief_at(at(300)).unwrap(), truth(robot, 300));
        let off = (belief.pose.x - truth.x).hypot(belief.pose.y - truth.y);
        assert!(off < 0.02, "robot {robot}: {off}");
    }
}

/// What makes a word one that is refused, and why.
type Forged = (fn(&mut HeardReadings), Refusal);

#[test]
fn what_is_forged_is_refused_under_its_reason_and_the_trees_are_as_they_were() {
    let honest = run(20, |_, _| false);
    let cases: [Forged; 9] = [
        (|it| it.origin.source = 9, Refusal::UnknownRobot),
        (|it| it.readings.trace = Some(0.0), Refusal::NotALeader),
        (|it| it.readings.slot.0 += 1, Refusal::WrongEvent),
        (
            |it| it.readings.sights[0].since = Span::from_millis(200),
            Refusal::WrongEvent,
        ),
        (
            |it| it.readings.sights[0].observed = id(8),
            Refusal::UnknownRobot,
        ),
        (
            |it| it.readings.sights[0].observed = id(0),
            Refusal::NotAChild,
        ),
        (|it| it.readings.sights[0].observed = id(4), Refusal::Looped),
        (
            |it| {
                it.readings.sights[1] = it.readings.sights[0];
                it.readings.count = 2;
            },
            Refusal::Looped,
        ),
        (
            |it| it.readings.sights[0].reading.relative.x = f64::NAN,
            Refusal::NotFinite,
        ),
    ];
    for (number, (change, reason)) in cases.into_iter().enumerate() {
        let mut robots: Vec<_> = (0..ROBOTS).map(Robot::new).collect();
        for tick in 1..=20 * EVENT {
            // The fourth robot's word goes out as it is, and forged ahead of that.
            drive(&mut robots, tick, |heard, _| {
                let mut forged = *heard;
                forged.origin.sequence += 1000;
                change(&mut forged);
                let is_of_fifth = heard.origin.source == id(4).0;
                let forged = is_of_fifth.then_some(forged);
                forged.into_iter().chain([*heard]).collect()
            });
        }
        let told =
            |robots: &[Robot]| -> Vec<_> { robots.iter().flat_map(|it| it.told.clone()).collect() };
        assert!(told(&robots) == told(&honest), "case {number}");
        let leaders = &robots[..LEADERS];
        let verdicts: Vec<_> = leaders.iter().flat_map(|it| &it.verdicts).collect();
        assert!(verdicts.len() > 10, "case {number}");
        let expected = (Kind::Assist, Verdict::Refused(reason));
        assert!(
            verdicts.iter().all(|it| **it == expected),
            "case {number}: {:?}",
            verdicts[0]
        );
    }
}

/// All of an event many times over, and of one that is long over.
#[test]
fn a_flood_of_what_was_said_before_changes_nothing() {
    let honest = run(20, |_, _| false);
    let mut robots: Vec<_> = (0..ROBOTS).map(Robot::new).collect();
    for tick in 1..=20 * EVENT {
        drive(&mut robots, tick, |heard, _| {
            let mut old = *heard;
            old.readings.slot.0 -= 2;
            old.readings.stamp = old.readings.stamp - Span::from_millis(400);
            let mut other = *heard;
            other.readings.sights[0].reading.relative.x += 1.0;
            [vec![old; 20], vec![*heard], vec![other; 20]].concat()
        });
    }
    for (robot, honest) in robots.iter().zip(&honest) {
        assert!(robot.told == honest.told);
    }
    assert!(robots[0].assistant.counts().declined > 400);
}
