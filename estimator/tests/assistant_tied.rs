//! What a leader says of its error, and what a child that tracks it makes of that: through the step, whatever comes late.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use coloc_estimator::assist::assistant::{Agreement, Assistant, Heard, Message, Words, step};
use coloc_estimator::assist::change::Change;
use coloc_estimator::assist::fusion::Rule;
use coloc_estimator::assist::search::Patience;
use coloc_estimator::assist::ties::{TIES, Tie};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, FusionSettings, Measurement, Motion,
    NeighbourPose, OdometrySample, Origin, Parts, Pose, PoseSaid, PositionFix, RobotId, Settings,
    Sighting, Slot, SlowError, Span, Stamp, TickInputs, Verdict, WithBonds,
};

const LEADER: RobotId = RobotId(1);
const CHILD: RobotId = RobotId(2);
const SECOND: RobotId = RobotId(3);
/// Nobody's leader and nobody's child.
const OTHER: RobotId = RobotId(9);
const TICK_MS: i64 = 20;
/// Ticks between two events.
const EVENT: i64 = 10;
/// Of the leader at the start, and of its fixes.
const P: f64 = 0.01;
const FIX: f64 = 0.0004;

type Places = WithBonds<Vec<Slot>, Vec<Tie>, Vec<Change>>;

fn at(tick: i64) -> Stamp {
    Stamp::from_nanos(1_000_000 * (1000 + TICK_MS * tick))
}

fn settings(history_ms: i64) -> Settings {
    let otherwise = FusionSettings {
        gate: 16.3,
        ..FusionSettings::paper()
    };
    Settings {
        assist: Rule::Cross { otherwise },
        history: Span::from_millis(history_ms),
        ..Settings::default()
    }
}

struct Robot {
    estimator: Box<Estimator<Places>>,
    assistant: Box<Assistant>,
}

impl Robot {
    fn new(id: RobotId, variance: f64, history_ms: i64) -> Self {
        let places = WithBonds {
            places: vec![Slot::default(); 512],
            ties: vec![Tie::default(); TIES],
            changes: vec![Change::default(); 512],
        };
        let covariance = Covariance3::diagonal([variance, variance, 1e-4]).unwrap();
        let belief = Belief::independent(Pose::default(), covariance);
        let patience = Patience {
            ack_timeout: 400,
            close_after: 800,
        };
        let period = Span::from_millis(TICK_MS * EVENT);
        let agreement = Agreement::new(&[LEADER], &[CHILD], period, patience).unwrap();
        Self {
            estimator: Box::new(Estimator::new(settings(history_ms), at(0), belief, places)),
            assistant: Box::new(Assistant::new(agreement, id).unwrap()),
        }
    }

    /// What it says.
    fn tick(&mut self, tick: i64, measurements: &[Measurement], data: &[Heard]) -> Vec<Message> {
        let inputs = TickInputs {
            stamp: at(tick),
            measurements,
        };
        let words = Words {
            data,
            ..Words::default()
        };
        let (outputs, carried) = step(&mut self.estimator, &mut self.assistant, &inputs, &words);
        for report in outputs.reports {
            let refused = !matches!(report.verdict, Verdict::Accepted { .. } | Verdict::Heard);
            assert!(!refused, "{report:?}");
        }
        carried.data.iter().map(|it| it.message).collect()
    }

    fn belief(&self, tick: i64) -> Belief {
        self.estimator.belief_at(at(tick)).unwrap()
    }
}

fn odometry(tick: i64) -> Measurement {
    driven(tick, [0.3, 0.1], 0.01)
}

fn driven(tick: i64, velocity: [f64; 2], noise: f64) -> Measurement {
    let motion = Motion::Nonholonomic {
        velocity,
        noise: Covariance2::diagonal([noise; 2]).unwrap(),
    };
    OdometrySample {
        source: 0,
        start: at(tick - 1),
        stamp: at(tick),
        motion,
    }
    .into()
}

/// Of a child that drives beside its leader.
fn sighting(tick: i64) -> Measurement {
    Sighting {
        stamp: at(tick),
        origin: Origin::counted(u64::try_from(tick).unwrap()),
        observed: CHILD,
        relative: Pose::default(),
        covariance: Covariance3::diagonal([0.0025, 0.0025, 0.0003]).unwrap(),
    }
    .into()
}

fn fix(tick: i64, position: [f64; 2], slow: f64) -> Measurement {
    PositionFix {
        stamp: at(tick),
        origin: Origin::counted(u64::try_from(tick).unwrap()),
        position,
        covariance: Covariance2::diagonal([FIX; 2]).unwrap(),
        lever: [0.0; 2],
        slow: SlowError {
            variance: slow,
            memory: Span::from_millis(60_000),
        },
    }
    .into()
}

fn heard(number: u64, message: &Message) -> Heard {
    let origin = Origin {
        source: LEADER.0,
        ..Origin::counted(number)
    };
    Heard {
        origin,
        message: *message,
    }
}

/// What a leader says that drives, has a fix at each event, and sees the child there.
fn said(ticks: i64) -> Vec<(i64, Message)> {
    let mut leader = Robot::new(LEADER, P, 1000);
    let mut all = Vec::new();
    for tick in 1..=ticks {
        let mut measurements = vec![odometry(tick)];
        if tick % EVENT == 2 {
            let Pose { x, y, .. } = leader.belief(tick - 1).pose;
            measurements.extend([fix(tick, [x + 0.01, y], 0.0), sighting(tick)]);
        }
        let told = leader.tick(tick, &measurements, &[]);
        all.extend(told.into_iter().map(|it| (tick, it)));
    }
    all
}

/// A child that hears each datum so many ticks late.
fn child(history_ms: i64, ticks: i64, late: impl Fn(i64) -> i64) -> Robot {
    let said = said(ticks);
    let mut child = Robot::new(CHILD, 0.04, history_ms);
    for tick in 1..=ticks {
        let due = said.iter().zip(1..);
        let due = due.filter(|((told, _), _)| told + late(*told) == tick);
        let data: Vec<_> = due.map(|((_, it), number)| heard(number, it)).collect();
        child.tick(tick, &[odometry(tick)], &data);
    }
    child
}

#[test]
fn what_comes_late_and_in_another_order_comes_to_the_same_bits() {
    let in_time = child(1000, 100, |_| 1);
    let count = in_time.assistant.counts().accepted;
    assert_eq!(count, 9, "the first event began before the child did");
    // Every other one comes after the next.
    let late = child(1000, 100, |told| if told / EVENT % 2 == 0 { 16 } else { 3 });
    assert!(late.assistant.counts().accepted + 1 >= count);
    assert_eq!(late.belief(80), in_time.belief(80));
}

#[test]
fn it_is_the_same_whether_data_are_in_the_history_or_have_left_it() {
    let [long, short] = [3000, 400].map(|history_ms| child(history_ms, 100, |_| 1));
    assert_eq!(long.belief(100), short.belief(100));
}

/// A child that tracks it is surer than one that takes the leader's error as one that may be correlated with anything, and less sure than
/// one that takes each datum as news.
#[test]
fn what_is_in_common_is_counted_once() {
    let trace = |rule: Rule| {
        let said = said(100);
        let mut child = Robot::new(CHILD, 0.04, 1000);
        let belief = child.belief(0);
        let settings = Settings {
            assist: rule,
            ..settings(1000)
        };
        let tracked = usize::from(rule.is_tracked());
        let places = WithBonds {
            places: vec![Slot::default(); 512],
            ties: vec![Tie::default(); TIES * tracked],
            changes: vec![Change::default(); 512 * tracked],
        };
        *child.estimator = Estimator::new(settings, at(0), belief, places);
        for tick in 1..=100 {
            let now = said.iter().zip(1..).filter(|((told, _), _)| *told == tick);
            let data: Vec<_> = now.map(|((_, it), number)| heard(number, it)).collect();
            child.tick(tick, &[odometry(tick)], &data);
        }
        child.belief(100).total().matrix().trace()
    };
    let [cross, split, kalman] = [settings(1000).assist, Rule::default(), Rule::paper()].map(trace);
    assert!(kalman < cross && cross < split, "{kalman} {cross} {split}");
}

/// Of the error that was sent so much is left in what the leader believes once a fix of before came.
#[test]
fn a_fix_that_comes_after_the_event_is_in_what_became_of_the_error() {
    let mut leader = Robot::new(LEADER, P, 1000);
    let mut told = Vec::new();
    let mut sent = Covariance3::ZERO;
    for tick in 1..=14 {
        let mut measurements = vec![driven(tick, [0.0; 2], 1e-6)];
        match tick {
            2 | 12 => measurements.push(sighting(tick)),
            7 => measurements.push(fix(1, [0.0; 2], 0.0)),
            _ => {}
        }
        told.extend(leader.tick(tick, &measurements, &[]));
        if tick == 2 {
            sent = leader.belief(2).total();
        }
    }
    let [first, second] = told.as_slice() else {
        panic!("{told:?}");
    };
    assert_eq!(first.word.leader.covariance, sent);
    assert_eq!((first.word.past.said, first.word.past.known), (0, 0));
    assert_eq!((second.word.past.said, second.word.past.known), (1, 1));
    let now = leader.belief(2).total();
    assert!(now.variances()[0] < 0.1 * sent.variances()[0]);
    let left = now.matrix() * sent.matrix().try_inverse().unwrap();
    let [[xx, ..], [_, yy, _], [.., pp]] = second.word.past.transitions[0];
    // It stands; there is no way of which a lever would come.
    for (said, expected) in [(xx, left.m11), (yy, left.m22), (pp, left.m33)] {
        assert!(
            (f64::from(said) - expected).abs() < 1e-6,
            "{said} {expected}"
        );
    }
}

#[test]
fn transitions_are_those_of_the_last_eight_events() {
    let all = said(100);
    let known: Vec<_> = all.iter().map(|(_, it)| it.word.past.known).collect();
    assert_eq!(known, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
    let said: Vec<_> = all.iter().map(|(_, it)| it.word.past.said).collect();
    assert_eq!(said, [0, 1, 2, 3, 4, 5, 6, 7, 8, 8]);
    // Φ over two events is that over one, after that over the one before.
    let of = |message: &Message, place: usize| {
        let rows = message.word.past.transitions[place];
        nalgebra::Matrix3::from_fn(|row, column| f64::from(rows[row][column]))
    };
    let [.., (_, before), (_, last)] = all.as_slice() else {
        panic!("{all:?}");
    };
    for place in 0..7 {
        let product = of(last, 0) * of(before, place);
        assert!(
            (product - of(last, place + 1)).abs().max() < 1e-6,
            "{place}"
        );
    }
}

/// What a leader learns at tick 35, and whether its chain is broken by it.
#[test]
fn a_chain_breaks_by_what_nobody_can_say_and_stands_again_at_the_next_event() {
    let own = |tick: i64| Pose::new(0.006 * f64::from(i32::try_from(tick).unwrap()), 0.0, 0.0);
    let covariance = Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap();
    let word = Measurement::from(NeighbourPose {
        stamp: at(35),
        origin: Origin {
            source: OTHER.0,
            ..Origin::counted(1)
        },
        pose: own(35),
        parts: Parts::dependent(covariance),
    });
    let pose = Measurement::from(PoseSaid {
        stamp: at(35),
        origin: Origin::counted(1),
        pose: own(35),
        covariance,
        set: true,
    });
    let own = own(35);
    let cases = [
        (fix(35, [own.x, own.y], 0.0), false),
        (fix(35, [own.x, own.y], 1.0), true),
        (word, true),
        (pose, true),
    ];
    for (learnt, breaks) in cases {
        let mut leader = Robot::new(LEADER, P, 400);
        let mut known = Vec::new();
        for tick in 1..=140 {
            let mut measurements = Vec::new();
            if tick % EVENT == 2 {
                measurements.push(sighting(tick));
            }
            if tick == 35 {
                measurements.push(learnt);
            }
            let told = leader.tick(tick, &measurements, &[]);
            known.extend(told.iter().map(|it| it.word.past.known));
        }
        let least = known.iter().skip(4).min().unwrap();
        assert_eq!(*least == 0, breaks, "{learnt:?}: {known:?}");
        assert!(*known.last().unwrap() > 4, "{learnt:?}: {known:?}");
    }
}

/// What two leaders say, the second one two ticks later and after the third event no more.
fn of_two(said: &[(i64, Message)], tick: i64) -> Vec<Heard> {
    let mut all = Vec::new();
    for ((told, message), number) in said.iter().zip(1..) {
        if *told == tick {
            all.push(heard(number, message));
        }
        if told + 2 == tick && *told < 3 * EVENT {
            let mut other = heard(number, message);
            (other.origin.source, other.message.path[0]) = (SECOND.0, SECOND);
            all.push(other);
        }
    }
    all
}

/// What waits for other leaders, or for its time, comes to the same in the end; until then nothing of it is believed.
#[test]
fn what_waits_is_fused_in_the_end_and_not_before() {
    let said = said(60);
    let run = |delay: Option<u32>| {
        let mut child = Robot::new(CHILD, 0.04, 1000);
        let patience = Patience {
            ack_timeout: 400,
            close_after: 800,
        };
        let period = Span::from_millis(TICK_MS * EVENT);
        let agreement = Agreement::new(&[LEADER, SECOND], &[CHILD], period, patience).unwrap();
        let agreement = Agreement { delay, ..agreement };
        *child.assistant = Assistant::new(agreement, CHILD).unwrap();
        let each = (1..=60).map(|tick| {
            child.tick(tick, &[odometry(tick)], &of_two(&said, tick));
            child.belief(tick)
        });
        each.collect::<Vec<_>>()
    };
    let [at_once, waits] = [None, Some(60)].map(run);
    let differ = |it: &usize| at_once[*it - 1] != waits[*it - 1];
    let differ: Vec<_> = (1..=60).filter(differ).collect();
    // When the second leader is heard first, the first one's pose is fused already. Then it is waited for, and later in vain for 60 ms.
    assert_eq!(differ, [14, 22, 23, 32, 33, 34, 42, 43, 44, 52, 53, 54]);
}
