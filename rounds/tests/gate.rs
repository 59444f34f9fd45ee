//! A round is no master key.

use coloc_estimator::Pose;
use coloc_rounds::gate::{CHI2_3_ONE_IN_A_MILLION, check};
use coloc_rounds::model::{Kind, predict};
use coloc_rounds::{Correction, Joint, Refusal, Shared, Standing};
use nalgebra::{Matrix3, Vector3};

const GATE: f64 = CHI2_3_ONE_IN_A_MILLION;

/// A sequence of numbers in −1 … 1 that looks random.
struct Draws(u64);

impl Draws {
    #[allow(clippy::cast_precision_loss)]
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn covariance(&mut self, sigma: f64) -> Matrix3<f64> {
        let root = Matrix3::from_fn(|i, j| self.next() * 0.6 + f64::from(u8::from(i == j)));
        root * root.transpose() * (sigma * sigma)
    }
}

fn shared(covariance: Matrix3<f64>) -> Shared {
    Shared {
        slot: 7,
        pose: Pose::new(1.0, -2.0, 3.1),
        covariance,
        psi: Matrix3::identity(),
        standing: Standing::Since(6),
    }
}

fn told(pose: Pose, covariance: Matrix3<f64>) -> Correction {
    Correction {
        slot: 7,
        pose,
        covariance,
        factor: 1.0,
    }
}

#[test]
fn an_honest_update_passes_however_often() {
    let mut draws = Draws(1);
    for _ in 0..2000 {
        let before = shared(draws.covariance(0.1));
        let other = (Pose::new(3.0, 1.0, 0.3), draws.covariance(0.1));
        let mut joint = Joint::new(&[(before.pose, before.covariance), other]);
        let noise = Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, 3e-4));
        let y = predict(Kind::Pose, &other.0, &before.pose).value;
        let off = Vector3::from_fn(|_, _| 0.1 * draws.next());
        joint.measure(Kind::Pose, [1, 0], (y + off).into(), &noise, 1e3);
        let after = told(joint.pose(0), joint.block(0, 0));
        assert_eq!(check(&before, &after, 2, GATE), Ok(()));
    }
}

#[test]
fn nothing_learned_and_nothing_moved_passes() {
    let before = shared(Draws(2).covariance(0.1));
    let same = told(before.pose, before.covariance);
    assert_eq!(check(&before, &same, 5, GATE), Ok(()));
}

#[test]
fn who_moves_without_having_learned_is_refused() {
    let before = shared(Draws(3).covariance(0.05));
    let Pose { x, y, phi } = before.pose;
    for far in [0.1, 0.3, 1.0, 10.0, 100.0] {
        for (dx, dy) in [(far, 0.0), (0.0, -far), (far, far)] {
            for left in [1.0, 0.999, 0.9] {
                let moved = told(Pose::new(x + dx, y + dy, phi), before.covariance * left);
                assert_eq!(
                    check(&before, &moved, 5, GATE),
                    Err(Refusal::TooFar),
                    "{far} m, {left} left"
                );
            }
        }
    }
}

#[test]
fn whatever_passes_has_moved_within_the_gate_of_what_was_shared() {
    let mut draws = Draws(4);
    let mut passed = 0;
    for _ in 0..20_000 {
        let before = shared(draws.covariance(0.1));
        let mut pose = before.pose;
        let far = libm::pow(10.0, 3.0 * draws.next() - 1.0);
        pose.x += far * draws.next();
        pose.y += far * draws.next();
        let left = draws.next().abs();
        if check(&before, &told(pose, before.covariance * left), 5, GATE).is_ok() {
            passed += 1;
            let moved = Vector3::new(pose.x - before.pose.x, pose.y - before.pose.y, 0.0);
            let inverse = before.covariance.try_inverse().expect("positive");
            assert!(moved.dot(&(inverse * moved)) <= GATE * (1.0 - left).max(1e-4) + 1e-9);
        }
    }
    assert!(passed > 1000, "{passed}");
}

#[test]
fn what_is_no_belief_is_refused_by_its_name() {
    let before = shared(Draws(5).covariance(0.1));
    let small = before.covariance * 0.5;
    let mut negative = small;
    negative[(0, 0)] = -1.0;
    let mut crooked = small;
    crooked[(0, 1)] += 0.01;
    for covariance in [negative, crooked, Matrix3::zeros(), small * f64::NAN] {
        let refused = check(&before, &told(before.pose, covariance), 5, GATE);
        assert_eq!(refused, Err(Refusal::NotABelief));
    }
    let nowhere = Pose {
        x: f64::INFINITY,
        ..before.pose
    };
    assert_eq!(
        check(&before, &told(nowhere, small), 5, GATE),
        Err(Refusal::NotABelief)
    );
    let larger = told(before.pose, before.covariance * 1.01);
    assert_eq!(check(&before, &larger, 5, GATE), Err(Refusal::LessCertain));
    let certain = told(before.pose, before.covariance * 1e-9);
    assert_eq!(check(&before, &certain, 5, GATE), Err(Refusal::TooCertain));
    for factor in [0.5, 5.1, f64::NAN] {
        let bound = Correction {
            factor,
            ..told(before.pose, small)
        };
        assert_eq!(check(&before, &bound, 5, GATE), Err(Refusal::Factor));
    }
}

#[test]
fn a_block_bound_may_leave_a_robot_less_certain_by_its_factor() {
    let before = shared(Draws(6).covariance(0.1));
    let with = |factor, covariance| Correction {
        factor,
        ..told(before.pose, covariance)
    };
    let twice = before.covariance * 2.0;
    assert_eq!(check(&before, &with(2.0, twice), 5, GATE), Ok(()));
    assert_eq!(
        check(&before, &with(1.0, twice), 5, GATE),
        Err(Refusal::LessCertain)
    );
}
