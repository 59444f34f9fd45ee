//! A receiver whose antenna is not where the body's frame begins: what it does to the belief, against many robots drawn at random.
#![allow(clippy::unwrap_used)] // A test may panic.

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, FoundSettings, Motion, OdometrySample,
    OdometrySettings, Origin, Pose, PositionFix, Propagation, Settings, Slot, SlowError, Span,
    Stamp, TickInputs, Verdict, step,
};

const LEVER: [f64; 2] = [1.2, -0.7];

/// Of mean zero and variance one; splitmix64, Box and Muller.
struct Normals(u64);

impl Normals {
    #[allow(clippy::cast_possible_truncation)] // 32 bits of them.
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        f64::from(((z ^ (z >> 31)) >> 32) as u32) / 4_294_967_296.0
    }

    fn draw(&mut self) -> f64 {
        let (length, turn) = (self.uniform(), self.uniform());
        (-2.0 * (1.0 - length).ln()).sqrt() * (std::f64::consts::TAU * turn).cos()
    }
}

/// Without noise of the wheels, without a gate, and without the judge that refuses to turn a wide heading by a fix.
fn settings(propagation: Propagation) -> Settings {
    Settings {
        propagation,
        position_gate: f64::INFINITY,
        found: FoundSettings::OFF,
        odometry: OdometrySettings {
            outage_variance: [0.0; 3],
            ..OdometrySettings::default()
        },
        ..Settings::default()
    }
}

fn fix(stamp: Stamp, position: [f64; 2], lever: [f64; 2]) -> PositionFix {
    PositionFix {
        stamp,
        origin: Origin::default(),
        position,
        covariance: Covariance2::diagonal([0.01; 2]).unwrap(),
        lever,
        slow: SlowError::default(),
    }
}

fn at(tick: i64) -> Stamp {
    Stamp::default() + Span::from_millis(20 * tick)
}

fn antenna(pose: &Pose) -> [f64; 2] {
    let ((sin, cos), [forward, left]) = (pose.phi.sin_cos(), LEVER);
    [
        pose.x + cos * forward - sin * left,
        pose.y + sin * forward + cos * left,
    ]
}

fn believing(prior: &Belief, propagation: Propagation) -> Estimator<Vec<Slot>> {
    let slots = vec![Slot::default(); 8];
    Estimator::new(settings(propagation), Stamp::default(), *prior, slots)
}

/// A robot drawn from the prior gets one fix: the mean of the squares of x, y and φ's errors, and what is claimed.
fn errors_after_a_fix(sigma: f64, propagation: Propagation) -> [(f64, f64); 3] {
    let mut random = Normals(7);
    let prior = Covariance3::diagonal([0.04, 0.09, sigma * sigma]).unwrap();
    let prior = Belief::independent(Pose::new(3.0, -2.0, 2.5), prior);
    let count = 4000;
    let mut sums = [(0.0, 0.0); 3];
    for _ in 0..count {
        let Pose { x, y, phi } = prior.pose;
        let truth = Pose {
            x: x + 0.2 * random.draw(),
            y: y + 0.3 * random.draw(),
            phi: phi + sigma * random.draw(),
        };
        let seen = antenna(&truth).map(|it| it + 0.1 * random.draw());
        let mut robot = believing(&prior, propagation);
        let inputs = TickInputs {
            stamp: at(1),
            measurements: &[fix(at(1), seen, LEVER).into()],
        };
        let outputs = step(&mut robot, &inputs);
        let belief = outputs.estimate.belief;
        let errors = [
            belief.pose.x - truth.x,
            belief.pose.y - truth.y,
            coloc_estimator::angle::wrap(belief.pose.phi - truth.phi),
        ];
        let claimed = belief.total().variances();
        for ((square, claim), (error, claimed)) in sums.iter_mut().zip(errors.iter().zip(claimed)) {
            *square += error * error / f64::from(count);
            *claim += claimed / f64::from(count);
        }
    }
    sums
}

/// The error is as large as is claimed, to what chance leaves of 4,000 robots; where the heading is all but unknown and so nothing is
/// linear, what is claimed of the position as a whole is more; of one axis alone it may be less, by 13 % of the variance here.
#[test]
fn what_a_lever_leaves_of_the_error_is_what_is_claimed() {
    for (sigma, allowed) in [(0.02, 0.93..1.07), (0.3, 0.90..1.07), (1.0, 0.6..1.1)] {
        for propagation in [Propagation::Honest, Propagation::Paper] {
            let sums = errors_after_a_fix(sigma, propagation);
            let [x, y, heading] = sums;
            for (square, claimed) in [(x.0 + y.0, x.1 + y.1), heading] {
                let ratio = square / claimed;
                assert!(
                    allowed.contains(&ratio),
                    "{sigma} {propagation:?}: {sums:?}"
                );
            }
        }
    }
}

/// The heading of a robot that stands is learnt by a lever, and by it alone.
#[test]
fn a_lever_teaches_the_heading() {
    let learnt = |lever: [f64; 2], seen: [f64; 2]| {
        let prior = Covariance3::diagonal([1e-4, 1e-4, 0.01]).unwrap();
        let prior = Belief::independent(Pose::default(), prior);
        let mut robot = believing(&prior, Propagation::Honest);
        for tick in 1..=50 {
            let inputs = TickInputs {
                stamp: at(tick),
                measurements: &[fix(at(tick), seen, lever).into()],
            };
            step(&mut robot, &inputs);
        }
        let belief = robot.extrapolated(at(50)).belief;
        (belief.pose.phi, belief.total().variances()[2])
    };
    let (heading, variance) = learnt(LEVER, antenna(&Pose::new(0.0, 0.0, 0.1)));
    assert!((heading - 0.1).abs() < 0.01 && variance < 4e-4, "{heading}");
    let (heading, variance) = learnt([0.0; 2], [0.0; 2]);
    assert!(heading == 0.0 && (variance - 0.01).abs() < 1e-12);
}

/// Driven and seen for long: neither part of the covariance loses its sign, and the lever costs no more than its nonlinearity.
#[test]
fn a_drive_of_minutes_with_a_lever_leaves_a_covariance() {
    for sigma in [0.05, 0.8] {
        let prior = Covariance3::diagonal([0.04, 0.09, sigma * sigma]).unwrap();
        let prior = Belief::independent(Pose::default(), prior);
        let mut robot = believing(&prior, Propagation::Honest);
        let mut random = Normals(3);
        let mut truth = Pose::default();
        for tick in 1..=3000_i32 {
            let turn = 0.02 * (0.01 * f64::from(tick)).sin();
            truth = Pose::new(
                truth.x + 0.02 * (truth.phi + 0.5 * turn).cos(),
                truth.y + 0.02 * (truth.phi + 0.5 * turn).sin(),
                truth.phi + turn,
            );
            let stamp = at(tick.into());
            let odometry = OdometrySample {
                source: 0,
                start: at((tick - 1).into()),
                stamp,
                motion: Motion::Nonholonomic {
                    velocity: [1.0, turn / 0.02],
                    noise: Covariance2::diagonal([1e-3, 1e-3]).unwrap(),
                },
            };
            let mut measurements = vec![odometry.into()];
            if tick % 10 == 0 {
                let seen = antenna(&truth).map(|it| it + 0.1 * random.draw());
                measurements.push(fix(stamp, seen, LEVER).into());
            }
            let inputs = TickInputs {
                stamp,
                measurements: &measurements,
            };
            let belief = step(&mut robot, &inputs).estimate.belief;
            let is_covariance =
                |part: Covariance3| Covariance3::from_row_major(part.to_row_major());
            assert!(is_covariance(belief.parts.independent).is_ok(), "{tick}");
            assert!(is_covariance(belief.parts.dependent).is_ok(), "{tick}");
        }
        let found = robot.extrapolated(at(3000)).belief;
        let error = [found.pose.x - truth.x, found.pose.y - truth.y];
        let [xx, yy, pp] = found.total().variances();
        assert!(
            error[0].powi(2) < 12.0 * xx && error[1].powi(2) < 12.0 * yy,
            "{sigma}"
        );
        assert!(pp < 1e-3 && xx < 0.01 && yy < 0.01, "{:?}", found.total());
    }
}

/// The least eigenvalue of a part over its trace.
fn least(part: &Covariance3) -> f64 {
    let matrix = part.matrix();
    let trace = matrix.trace();
    if trace == 0.0 {
        return 0.0;
    }
    (matrix / trace).symmetric_eigenvalues().min()
}

/// Of beliefs that are known to a millimetre, the bend that a lever brings is more than the dependent part: what is taken away again on
/// the way back is what was brought.
#[test]
fn neither_part_loses_its_sign_where_a_lever_is_large_beside_what_is_known() {
    let mut random = Normals(11);
    let mut worst: f64 = 0.0;
    for life in 0..4000 {
        let mut size = |low: f64| 10_f64.powf(low * random.uniform());
        let (known, heading, noise) = (size(-4.0), size(-5.0), size(-4.0));
        let mut column = |w: f64| {
            let [x, y, phi] = [(); 3].map(|()| random.draw());
            nalgebra::Vector3::new(w * known * x, w * known * y, w * heading * phi)
        };
        let (a, b, c, d) = (column(1.0), column(1.0), column(1.0), column(1e-3));
        let of = |matrix: nalgebra::Matrix3<f64>| {
            Covariance3::new(0.5 * (matrix + matrix.transpose())).unwrap_or_default()
        };
        let parts = coloc_estimator::Parts {
            independent: of(a * a.transpose() + b * b.transpose() + c * c.transpose()),
            dependent: of(d * d.transpose()),
        };
        let prior = Belief::gaussian(Pose::new(82.0, -95.0, 2.1), parts);
        let mut robot = believing(&prior, Propagation::Honest);
        for tick in 1..=6 {
            let odometry = OdometrySample {
                source: 0,
                start: at(tick - 1),
                stamp: at(tick),
                motion: Motion::Nonholonomic {
                    velocity: [1.0, 0.3],
                    noise: Covariance2::diagonal([known * known, 0.0]).unwrap(),
                },
            };
            let seen = antenna(&robot.extrapolated(at(tick - 1)).belief.pose);
            let seen = seen.map(|it| it + noise * random.draw());
            let fix = PositionFix {
                covariance: Covariance2::diagonal([noise * noise; 2]).unwrap(),
                ..fix(at(tick), seen, LEVER)
            };
            let inputs = TickInputs {
                stamp: at(tick),
                measurements: &[odometry.into(), fix.into()],
            };
            let parts = step(&mut robot, &inputs).estimate.belief.parts;
            let [independent, dependent] =
                [parts.independent, parts.dependent].map(|it| least(&it));
            worst = worst.min(independent).min(dependent);
            assert!(worst > -1e-14, "{life} {tick}: {independent} {dependent}");
        }
    }
}

#[test]
fn a_refused_fix_changes_nothing_and_a_lever_of_zero_nothing_either() {
    let prior = Covariance3::diagonal([0.04, 0.09, 0.01]).unwrap();
    let prior = Belief::independent(Pose::default(), prior);
    let after = |position: [f64; 2], lever: [f64; 2]| {
        let slots = vec![Slot::default(); 8];
        let settings = Settings {
            position_gate: Settings::default().position_gate,
            ..settings(Propagation::Honest)
        };
        let mut robot = Estimator::new(settings, Stamp::default(), prior, slots);
        let inputs = TickInputs {
            stamp: at(1),
            measurements: &[fix(at(1), position, lever).into()],
        };
        let outputs = step(&mut robot, &inputs);
        (outputs.estimate.belief, outputs.reports[0].verdict)
    };
    let (refused, verdict) = after([9.0, 0.0], LEVER);
    assert!(matches!(verdict, Verdict::Gated { .. }) && refused == prior);
    let (plain, _) = after([0.1, 0.1], [0.0; 2]);
    let (negative_zero, _) = after([0.1, 0.1], [-0.0, 0.0]);
    assert!(plain == negative_zero && plain != prior);
    let (moved, verdict) = after([1.3, -0.6], LEVER);
    assert!(matches!(verdict, Verdict::Accepted { .. }) && moved != plain);
}
