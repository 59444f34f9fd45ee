//! A program that reads a robot's estimates knows the pose at the time of its scan as the robot itself did.
#![allow(clippy::unwrap_used)] // A test may panic.

use std::time::Duration;

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimate, Estimator, FindingState, Measurement, Motion,
    OdometrySample, Origin, Pose, PoseSaid, PositionFix, Settings, Slot, SlowError, Span, Stamp,
    TickInputs, step,
};
use coloc_shm_types::{self as shm, BeliefState, Header, Track};

type Robot = Estimator<Vec<Slot>>;

const TICKS: i64 = 300;

fn stamp(tick: i64) -> Stamp {
    Stamp::default() + Span::from_millis(20 * tick)
}

fn robot(sigma_rad: f64) -> Robot {
    let covariance = Covariance3::diagonal([0.01, 0.02, sigma_rad * sigma_rad]).unwrap();
    let belief = Belief::independent(Pose::new(1.0, -2.0, 2.5), covariance);
    let storage = vec![Slot::default(); 1024];
    Estimator::new(Settings::default(), stamp(0), belief, storage)
}

/// Faster and slower, to the left and to the right.
fn sample(tick: i64) -> OdometrySample {
    let time_s = 0.02 * f64::from(i32::try_from(tick).unwrap());
    let noise = Covariance2::from_row_major([0.04, 0.002, 0.002, 0.01]).unwrap();
    let velocity = [1.0 + 0.5 * time_s.sin(), (0.7 * time_s).cos()];
    OdometrySample {
        source: 0,
        start: stamp(tick - 1),
        stamp: stamp(tick),
        motion: Motion::Nonholonomic { velocity, noise },
    }
}

/// Twice in a second, at the tick's own stamp or three ticks late.
fn fix(tick: i64, robot: &Robot) -> Option<PositionFix> {
    let late = 3 * (tick / 25 % 2);
    let pose = robot.belief_at(stamp(tick - 1 - late))?.pose;
    (tick % 25 == 0).then(|| PositionFix {
        stamp: stamp(tick - late),
        origin: Origin::default(),
        position: [pose.x + 0.05, pose.y - 0.03],
        covariance: Covariance2::diagonal([0.04, 0.04]).unwrap(),
        lever: [0.0; 2],
        slow: SlowError::default(),
    })
}

/// Somebody says twice that the robot is far from where it believes.
fn set(tick: i64, robot: &Robot) -> Option<PoseSaid> {
    let pose = robot.belief_at(stamp(tick - 1))?.pose;
    [80, 180].contains(&tick).then(|| PoseSaid {
        stamp: stamp(tick),
        origin: Origin::default(),
        pose: Pose::new(pose.x + 100.0, pose.y + 50.0, pose.phi + 1.0),
        covariance: Covariance3::diagonal([0.01, 0.01, 0.0025]).unwrap(),
        set: true,
    })
}

fn knows(robot: &Robot) -> bool {
    robot.finding().state == FindingState::Ok
}

fn said(tick: i64, estimate: &Estimate, knows: bool) -> shm::Estimate {
    let (belief, driven) = (&estimate.belief, estimate.driven);
    shm::Estimate {
        header: Header {
            stamp_ns: 7_000 + estimate.stamp.as_nanos(),
            ..Header::default()
        },
        boot_ns: estimate.stamp.as_nanos(),
        tick: tick.unsigned_abs(),
        pose: [belief.pose.x, belief.pose.y, belief.pose.phi],
        odometry: [driven.x, driven.y, driven.phi],
        velocity: estimate.velocity,
        independent: belief.parts.independent.to_row_major(),
        dependent: belief.parts.dependent.to_row_major(),
        velocity_covariance: estimate.velocity_covariance.to_row_major(),
        state: if knows {
            BeliefState::Ok
        } else {
            BeliefState::Finding
        } as u8,
        ..shm::Estimate::default()
    }
}

fn close(found: [f64; 3], expected: Pose) -> bool {
    let turned = (found[2] - expected.phi).sin().abs();
    (found[0] - expected.x).abs() < 1e-6 && (found[1] - expected.y).abs() < 1e-6 && turned < 1e-6
}

fn assert_same(found: &shm::PastPose, twin: &Estimate, what: &str) {
    assert!(close(found.pose, twin.belief.pose), "{what}: {found:?}");
    assert!(close(found.odometry, twin.driven), "{what}: {found:?}");
    let (expected, found) = (twin.belief.total().to_row_major(), found.covariance);
    for (place, (found, expected_here)) in found.iter().zip(&expected).enumerate() {
        let [one, other] = [expected[4 * (place / 3)], expected[4 * (place % 3)]];
        let off = (found - expected_here).abs() / (one * other).sqrt();
        assert!(off < 1e-4, "{what}, entry {place}: off by {off:e}");
    }
}

/// Of a robot that looks for itself: a covariance, and no farther off than it drives in a tick.
fn assert_guess(found: &shm::PastPose, twin: &Estimate, what: &str) {
    let (pose, expected) = (found.pose, twin.belief.pose);
    let off = (pose[0] - expected.x).hypot(pose[1] - expected.y);
    assert!(off < 0.03, "{what}: off by {off} m");
    let covariance = Covariance3::from_row_major(found.covariance);
    assert!(covariance.is_ok(), "{what}: {found:?}");
}

/// How far the mean went beyond the way driven, from one estimate to the next \[m\].
fn jumped(before: &Estimate, after: &Estimate) -> f64 {
    let way = |it: &Estimate| it.belief.pose;
    let driven = (after.driven.x - before.driven.x).hypot(after.driven.y - before.driven.y);
    let moved = (way(after).x - way(before).x).hypot(way(after).y - way(before).y);
    (moved - driven).abs()
}

/// The twin has heard the same up to then, knows what the wheels do, and is asked for its belief at the moment itself.
#[test]
fn a_reader_knows_the_past_as_a_twin_did() {
    for sigma_rad in [0.01, 0.1, 0.3, 1.0, 3.0, 10.0] {
        let (mut robot, mut track) = (robot(sigma_rad), Track::new(Duration::from_secs(2)));
        let (mut learnt, mut was_set) = (0, 0);
        for tick in 1..=TICKS {
            let mut twin = robot.clone();
            let mut given = vec![Measurement::from(sample(tick))];
            let wheels = TickInputs {
                stamp: stamp(tick - 1),
                measurements: &given.clone(),
            };
            let before = step(&mut twin, &wheels).estimate;
            given.extend(fix(tick, &robot).map(Measurement::from));
            given.extend(set(tick, &robot).map(Measurement::from));
            let inputs = TickInputs {
                stamp: stamp(tick),
                measurements: &given,
            };
            let estimate = step(&mut robot, &inputs).estimate;
            track.note(&said(tick, &estimate, knows(&robot)));
            if tick < 3 {
                continue;
            }
            let (jump, knew) = (jumped(&before, &estimate), knows(&twin));
            learnt += i32::from(knew && jump > 1e-3);
            was_set += i32::from(knew && jump > 10.0);
            for millis in [1, 5, 10, 17] {
                let then = stamp(tick - 1) + Span::from_millis(millis);
                let twin = twin.extrapolated(then);
                let by_boot = track.at_boot(then.as_nanos()).unwrap();
                let by_the_wall = track.at(7_000 + then.as_nanos()).unwrap();
                let what = format!("σ {sigma_rad} rad, tick {tick} + {millis} ms");
                for found in [&by_boot, &by_the_wall] {
                    if knew {
                        assert_same(found, &twin, &what);
                    } else {
                        assert_guess(found, &twin, &what);
                    }
                }
            }
        }
        assert!(
            learnt >= 4 && was_set >= 1,
            "{learnt} learnt, {was_set} set"
        );
    }
}
