//! A pose that a person sets is believed; one that a map says is judged like any other source's.

#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

use coloc_estimator::{
    Covariance2, Covariance3, Decision, Estimator, FindingState, FoundSettings, Kind, Measurement,
    OdometryNoise, OdometrySample, Origin, Pose, PoseSaid, PositionFix, Settings, Slot, SlowError,
    Source, Span, Stamp, Start, TickInputs, Verdict, step,
};

const PERIOD: Span = Span::from_millis(20);
/// Ticks of the history, and one more.
const SETTLED: i64 = 51;
const TICKS_A_SECOND: i64 = 50;

fn at(tick: i64) -> Stamp {
    Stamp::from_nanos(tick * PERIOD.as_nanos())
}

/// A robot that drives straight on at 1 m/s.
struct Robot {
    estimator: Estimator<Vec<Slot>>,
    tick: i64,
    verdicts: Vec<(Source, Verdict)>,
    decisions: Vec<Decision>,
}

impl Robot {
    fn starting(start: &Start, settings: &Settings) -> Self {
        let slots = vec![Slot::default(); 512];
        Self {
            estimator: Estimator::starting(*settings, at(0), start, slots),
            tick: 0,
            verdicts: Vec::new(),
            decisions: Vec::new(),
        }
    }

    fn knowing(pose: Pose) -> Self {
        let covariance = Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap();
        let belief = coloc_estimator::Belief::independent(pose, covariance);
        Self::starting(&Start::Known(belief), &Settings::default())
    }

    /// The next tick, in which `said` arrives.
    fn tick(&mut self, said: &[Measurement]) -> Pose {
        self.tick += 1;
        let wheels = OdometrySample {
            source: 0,
            start: at(self.tick - 1),
            stamp: at(self.tick),
            motion: OdometryNoise::paper().nonholonomic([1.0, 0.0]),
        };
        let mut measurements = vec![wheels.into()];
        measurements.extend_from_slice(said);
        let inputs = TickInputs {
            stamp: at(self.tick),
            measurements: &measurements,
        };
        let outputs = step(&mut self.estimator, &inputs);
        let decided = outputs.finding.decisions().iter();
        self.decisions.extend(decided.map(|(_, decision)| decision));
        let reports = outputs.reports.iter();
        self.verdicts
            .extend(reports.map(|report| (report.source, report.verdict)));
        outputs.estimate.belief.pose
    }

    fn ticks(&mut self, count: i64) -> Pose {
        (0..count).map(|_| self.tick(&[])).last().unwrap()
    }

    /// A fix five times a second, of a receiver that has the robot in `place(t)`.
    fn hears(&mut self, seconds: i64, place: impl Fn(f64) -> [f64; 2]) -> Pose {
        let mut pose = Pose::default();
        for _ in 0..seconds * TICKS_A_SECOND {
            let tick = self.tick + 1;
            let fix = fix(tick, place((at(tick) - at(0)).as_seconds()));
            let said: &[_] = if tick % 10 == 0 { &[fix] } else { &[] };
            pose = self.tick(said);
        }
        pose
    }

    fn state(&self) -> FindingState {
        self.estimator.finding().state
    }

    fn verdict(&self) -> Verdict {
        let mut own = self.verdicts.iter().filter(|(it, _)| *it == source());
        own.next_back().unwrap().1
    }
}

fn source() -> Source {
    Source::new(Kind::Pose, 3)
}

fn said(tick: i64, pose: Pose, set: bool) -> Measurement {
    PoseSaid {
        stamp: at(tick),
        origin: Origin {
            source: 3,
            ..Origin::counted(tick.unsigned_abs())
        },
        pose,
        covariance: Covariance3::diagonal([0.25, 0.25, 0.01]).unwrap(),
        set,
    }
    .into()
}

fn fix(tick: i64, position: [f64; 2]) -> Measurement {
    PositionFix {
        stamp: at(tick),
        origin: Origin::counted(tick.unsigned_abs()),
        position,
        covariance: Covariance2::diagonal([0.01, 0.01]).unwrap(),
        lever: [0.0; 2],
        slow: SlowError::default(),
    }
    .into()
}

fn is_near(pose: Pose, [x, y, phi]: [f64; 3]) -> bool {
    let turned = coloc_estimator::angle::wrap(pose.phi - phi);
    (pose.x - x).hypot(pose.y - y) < 0.05 && turned.abs() < 0.02
}

/// 200 m away and turned around, it drives on from there.
const ELSEWHERE: Pose = Pose {
    x: 200.0,
    y: -30.0,
    phi: 3.0,
};

/// Where it is `ticks` after it was there.
fn driven_on(ticks: i64) -> [f64; 3] {
    let way = (at(ticks) - at(0)).as_seconds();
    let (sin, cos) = ELSEWHERE.phi.sin_cos();
    [
        ELSEWHERE.x + way * cos,
        ELSEWHERE.y + way * sin,
        ELSEWHERE.phi,
    ]
}

#[test]
fn a_set_pose_is_believed_after_a_history_whatever_was_believed() {
    let nowhere = |settings| Robot::starting(&Start::Unknown, &settings);
    let paper = Settings {
        found: FoundSettings::OFF,
        ..Settings::default()
    };
    let robots = vec![
        (Robot::knowing(Pose::default()), true),
        (nowhere(Settings::default()), false),
        (nowhere(paper), false),
    ];
    for (mut robot, knew) in robots {
        robot.ticks(100);
        let before = robot.tick(&[said(101, ELSEWHERE, true)]);
        assert_eq!(robot.verdict(), Verdict::Heard);
        assert_eq!(is_near(before, [2.02, 0.0, 0.0]), knew, "not yet");
        let after = robot.ticks(SETTLED);
        assert!(is_near(after, driven_on(SETTLED)), "{after:?}");
        assert_eq!(robot.state(), FindingState::Ok);
        let [
            Decision::Set {
                source: by,
                distance_m,
            },
        ] = robot.decisions[..]
        else {
            panic!("{:?}", robot.decisions);
        };
        assert_eq!((by, distance_m.is_nan()), (source(), !knew));
        let believed = robot.estimator.belief_at(at(robot.tick)).unwrap();
        let [x, y, _] = believed.parts.dependent.variances();
        assert!(x >= 0.25 && y >= 0.25, "nothing of it is independent");
    }
}

#[test]
fn what_was_held_against_the_belief_before_is_forgotten() {
    let mut robot = Robot::knowing(Pose::default());
    robot.hears(5, |t| [t, 0.0]);
    // It is carried, and its receiver says so for two seconds; then somebody says where it is.
    robot.hears(2, |t| [200.0 - t, -30.0]);
    robot.ticks(SETTLED);
    assert_eq!(robot.estimator.finding().dissents().len(), 1);
    let tick = robot.tick + 1;
    robot.tick(&[said(tick, ELSEWHERE, true)]);
    robot.ticks(SETTLED);
    assert_eq!(robot.state(), FindingState::Ok);
    assert_eq!(robot.estimator.finding().dissents().len(), 0);
}

#[test]
fn an_honest_receiver_takes_over_from_a_wrong_pose() {
    let mut robot = Robot::knowing(Pose::default());
    robot.hears(5, |t| [t, 0.0]);
    let tick = robot.tick + 1;
    robot.tick(&[said(tick, ELSEWHERE, true)]);
    let wrong = robot.hears(2, |t| [t, 0.0]);
    assert!(wrong.x > 190.0, "{wrong:?}");
    let right = robot.hears(6, |t| [t, 0.0]);
    assert!(right.x.hypot(right.y) < 20.0, "{right:?}");
    let followed =
        |it: &Decision| matches!(it, Decision::Followed { source, .. } if source.kind == Kind::Fix);
    assert!(
        robot.decisions.iter().any(followed),
        "{:?}",
        robot.decisions
    );
    let way = (at(robot.tick) - at(0)).as_seconds();
    assert!((right.x - way).hypot(right.y) < 0.5, "{right:?}");
    assert_eq!(robot.state(), FindingState::Ok);
}

#[test]
fn a_map_is_one_more_source() {
    let mut robot = Robot::knowing(Pose::default());
    robot.ticks(100);
    let near = Pose::new(2.1, 0.1, 0.01);
    robot.tick(&[said(101, near, false)]);
    assert!(matches!(robot.verdict(), Verdict::Accepted { .. }));
    robot.ticks(99);
    robot.tick(&[said(201, ELSEWHERE, false)]);
    assert!(matches!(robot.verdict(), Verdict::Gated { .. }));
    let after = robot.ticks(SETTLED);
    assert!(after.x < 6.0, "{after:?}");
}

#[test]
fn a_robot_that_knows_nothing_finds_itself_by_a_map() {
    let mut robot = Robot::starting(&Start::Unknown, &Settings::default());
    for tick in 1..=6 * TICKS_A_SECOND {
        let [x, y, phi] = driven_on(tick);
        let word = said(tick, Pose::new(x, y, phi), false);
        let said: &[_] = if tick % 10 == 0 { &[word] } else { &[] };
        robot.tick(said);
    }
    assert_eq!(robot.state(), FindingState::Ok);
    let pose = robot.ticks(1);
    assert!(is_near(pose, driven_on(robot.tick)), "{pose:?}");
}

/// What is measured, and the tick in which it arrives.
fn run(deliveries: &[(i64, Measurement)]) -> (Vec<Decision>, [u64; 6]) {
    let mut robot = Robot::knowing(Pose::default());
    for tick in 1..=4 * TICKS_A_SECOND {
        let due: Vec<_> = deliveries
            .iter()
            .filter(|(arrival, _)| *arrival == tick)
            .map(|(_, it)| *it)
            .collect();
        robot.tick(&due);
    }
    let belief = robot.estimator.belief_at(at(robot.tick)).unwrap();
    let [a, b, c] = belief.total().variances();
    let numbers = [belief.pose.x, belief.pose.y, belief.pose.phi, a, b, c];
    (robot.decisions, numbers.map(f64::to_bits))
}

#[test]
fn the_order_of_delivery_changes_no_bit() {
    let mut other = ELSEWHERE;
    other.y += 3.0;
    let measured = [
        (20, said(20, Pose::new(0.4, 0.0, 0.0), false)),
        (30, said(30, ELSEWHERE, true)),
        (50, said(50, other, true)),
        (52, fix(52, [199.0, -27.0])),
        (65, said(65, other, false)),
    ];
    let prompt = run(&measured);
    assert_eq!(prompt.0.len(), 2, "{:?}", prompt.0);
    let late = measured.map(|(tick, it)| (tick + 45, it));
    let mut backwards = measured.map(|(_, it)| (68, it));
    backwards.swap(1, 2);
    backwards.reverse();
    let twice: Vec<_> = measured.into_iter().chain(late).collect();
    for deliveries in [&late[..], &backwards, &twice] {
        assert_eq!(run(deliveries), prompt);
    }
}

#[test]
fn what_claims_to_be_exact_or_is_no_pose_is_refused() {
    let refused = |spoil: fn(&mut PoseSaid)| {
        let mut robot = Robot::knowing(Pose::default());
        let Measurement::Pose(mut word) = said(1, ELSEWHERE, true) else {
            unreachable!("it is one");
        };
        spoil(&mut word);
        robot.tick(&[word.into()]);
        let pose = robot.ticks(SETTLED);
        assert!(pose.x < 5.0, "{pose:?}");
        robot.verdict()
    };
    let exact = refused(|it| it.covariance = Covariance3::diagonal([0.1, 0.0, 0.1]).unwrap());
    assert_eq!(exact, Verdict::NoNoise);
    assert_eq!(refused(|it| it.pose.x = f64::NAN), Verdict::NotFinite);
}
