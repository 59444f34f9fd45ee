//! A program that reads a robot's estimates knows the pose at the time of its scan as the robot itself did.
#![allow(clippy::unwrap_used)] // A test may panic.

use std::time::Duration;

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimate, Estimator, FoundSettings, Measurement, Motion,
    OdometrySample, Origin, Pose, PositionFix, Settings, Slot, SlowError, Span, Stamp, TickInputs,
    step,
};
use coloc_shm_types::{self as shm, Header, Track};

type Robot = Estimator<Vec<Slot>>;

const TICKS: i64 = 300;

fn stamp(tick: i64) -> Stamp {
    Stamp::default() + Span::from_millis(20 * tick)
}

fn robot(sigma_rad: f64) -> Robot {
    let covariance = Covariance3::diagonal([0.01, 0.02, sigma_rad * sigma_rad]).unwrap();
    let belief = Belief::independent(Pose::new(1.0, -2.0, 2.5), covariance);
    let storage = vec![Slot::default(); 1024];
    // At any heading: the pose of a robot that looks for itself is no function of its wheels alone.
    let settings = Settings {
        found: FoundSettings::OFF,
        ..Settings::default()
    };
    Estimator::new(settings, stamp(0), belief, storage)
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

/// Once in a second, at the tick's own stamp.
fn fix(tick: i64, robot: &Robot) -> Option<PositionFix> {
    let pose = robot.belief_at(stamp(tick - 1))?.pose;
    (tick % 50 == 0).then(|| PositionFix {
        stamp: stamp(tick),
        origin: Origin::default(),
        position: [pose.x + 0.05, pose.y - 0.03],
        covariance: Covariance2::diagonal([0.04, 0.04]).unwrap(),
        lever: [0.0; 2],
        slow: SlowError::default(),
    })
}

fn said(tick: i64, estimate: &Estimate) -> shm::Estimate {
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

/// The twin lives through the same and is asked for its belief at the moment itself.
#[test]
fn a_reader_knows_the_past_as_a_twin_did() {
    for sigma_rad in [0.01, 0.3, 1.0, 3.0, 10.0] {
        let (mut robot, mut track) = (robot(sigma_rad), Track::new(Duration::from_secs(2)));
        for tick in 1..=TICKS {
            let before = robot.clone();
            let mut given = vec![Measurement::from(sample(tick))];
            given.extend(fix(tick, &robot).map(Measurement::from));
            let inputs = TickInputs {
                stamp: stamp(tick),
                measurements: &given,
            };
            let estimate = step(&mut robot, &inputs).estimate;
            track.note(&said(tick, &estimate));
            if tick < 3 || given.len() > 1 {
                continue; // Between two ticks of which the second has learnt, there is no one belief.
            }
            for millis in [1, 5, 10, 17] {
                let then = stamp(tick - 1) + Span::from_millis(millis);
                let mut twin = before.clone();
                let inputs = TickInputs {
                    stamp: then,
                    measurements: &given,
                };
                let twin = step(&mut twin, &inputs).estimate;
                let found = track.at_boot(then.as_nanos()).unwrap();
                let what = format!("σ {sigma_rad} rad, tick {tick} + {millis} ms");
                assert_same(&found, &twin, &what);
                let by_the_wall = track.at(7_000 + then.as_nanos()).unwrap();
                assert_same(&by_the_wall, &twin, &what);
            }
        }
    }
}
