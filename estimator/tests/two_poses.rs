//! The pose in the common frame jumps when the robot learns; that in the odometry frame never does.
#![allow(clippy::unwrap_used)] // A test may panic.

use core::f64::consts::PI;

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimate, Estimator, Measurement, Motion, OdometrySample,
    Origin, Pose, PositionFix, Settings, Slot, SlowError, Span, Stamp, TickInputs, step,
};

const SPEED_MPS: f64 = 1.0;
const RATE_RADPS: f64 = 0.5;
const PERIOD_S: f64 = 0.02;

fn stamp(tick: i64) -> Stamp {
    Stamp::default() + Span::from_millis(20 * tick)
}

fn robot(sigma: [f64; 3]) -> Estimator<Vec<Slot>> {
    let covariance = Covariance3::diagonal(sigma.map(|it| it * it)).unwrap();
    let belief = Belief::independent(Pose::new(5.0, 6.0, 2.0), covariance);
    Estimator::new(
        Settings::default(),
        stamp(0),
        belief,
        vec![Slot::default(); 256],
    )
}

/// A circle of 2 m.
fn sample(tick: i64) -> Measurement {
    let noise = Covariance2::diagonal([0.01, 0.01]).unwrap();
    let motion = Motion::Nonholonomic {
        velocity: [SPEED_MPS, RATE_RADPS],
        noise,
    };
    OdometrySample {
        source: 0,
        start: stamp(tick - 1),
        stamp: stamp(tick),
        motion,
    }
    .into()
}

fn fix(tick: i64, position: [f64; 2]) -> Measurement {
    PositionFix {
        stamp: stamp(tick),
        origin: Origin::default(),
        position,
        covariance: Covariance2::diagonal([0.01, 0.01]).unwrap(),
        lever: [0.0; 2],
        slow: SlowError::default(),
    }
    .into()
}

fn tick(robot: &mut Estimator<Vec<Slot>>, tick: i64, measurements: &[Measurement]) -> Estimate {
    let stamp = stamp(tick);
    let inputs = TickInputs {
        stamp,
        measurements,
    };
    step(robot, &inputs).estimate
}

/// Where the circle leads that begins at the origin.
fn on_the_circle(tick: i64) -> Pose {
    let ticks = i32::try_from(tick).unwrap();
    let angle = RATE_RADPS * PERIOD_S * f64::from(ticks);
    let radius = SPEED_MPS / RATE_RADPS;
    Pose::new(
        radius * libm::sin(angle),
        radius * (1.0 - libm::cos(angle)),
        angle,
    )
}

fn distance(a: Pose, b: Pose) -> f64 {
    libm::hypot(a.x - b.x, a.y - b.y)
}

#[test]
fn what_the_robot_learns_moves_one_pose_and_not_the_other() {
    let mut robot = robot([1.0, 1.0, 0.1]);
    let (mut jumped, mut last) = (0.0_f64, Estimate::default());
    for number in 1..=200 {
        let mut given = vec![sample(number)];
        if number % 50 == 0 {
            given.push(fix(number, [6.0, 7.0]));
        }
        let now = tick(&mut robot, number, &given);
        let (expected, found) = (on_the_circle(number), now.driven);
        assert!(distance(expected, found) < 1e-12, "{found:?}");
        assert!((expected.phi - found.phi).abs() < 1e-12);
        assert!(distance(now.driven, last.driven) <= SPEED_MPS * PERIOD_S + 1e-12);
        if number > 1 {
            jumped = jumped.max(distance(now.belief.pose, last.belief.pose));
        }
        last = now;
    }
    assert!(jumped > 0.5, "the fixes moved it by {jumped} m at most");
}

/// The mean over all headings hardly moves, but the wheels have turned.
#[test]
fn who_does_not_know_the_heading_still_knows_the_way() {
    let mut robot = robot([0.1, 0.1, PI]);
    let begin = Pose::new(5.0, 6.0, 2.0);
    let mut now = Estimate::default();
    for number in 1..=50 {
        now = tick(&mut robot, number, &[sample(number)]);
    }
    assert!(distance(now.belief.pose, begin) < 0.02);
    assert!(distance(now.driven, on_the_circle(50)) < 1e-12);
}

#[test]
fn in_whatever_order_samples_come_the_way_is_the_same() {
    let (mut prompt, mut late) = (robot([0.1; 3]), robot([0.1; 3]));
    let mut expected = Estimate::default();
    for number in 1..=20 {
        expected = tick(&mut prompt, number, &[sample(number)]);
    }
    let mut found = Estimate::default();
    for number in [1, 2, 4, 3, 5, 9, 8, 7, 6, 10] {
        found = tick(&mut late, 20, &[sample(number + 10), sample(number)]);
    }
    assert_eq!(found.driven, expected.driven);
}
