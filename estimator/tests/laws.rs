//! What holds for every valid input: laws of the filter, tried on random beliefs of all shapes and sizes.

#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

use coloc_estimator::convert::tell;
use coloc_estimator::settings::{Criterion, FusionSettings, GateWeight};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Fusion, GlobalPose, Motion, Parts, Pose, Propagation,
    Settings, fix, fuse, propagate, to_global,
};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, RngSeed, TestRunner};

/// The same cases on every run.
fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(20_160_211),
        rng_algorithm: RngAlgorithm::ChaCha,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

fn unit() -> impl Strategy<Value = f64> {
    -1.0..1.0
}

/// Zero as often as not: singular factors are a normal state.
fn scale() -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(0.0), 3 => (-4.0..0.5).prop_map(|e: f64| 10.0_f64.powf(e))]
}

/// `F Fᵀ` with F lower triangular, of any rank.
fn factor() -> impl Strategy<Value = Matrix3<f64>> {
    ([scale(), scale(), scale()], [unit(), unit(), unit()]).prop_map(|([a, b, c], [p, q, r])| {
        let f = Matrix3::new(a, 0.0, 0.0, p * b, b, 0.0, q * c, r * c, c);
        f * f.transpose()
    })
}

fn pose() -> impl Strategy<Value = Pose> {
    (-20.0..20.0, -20.0..20.0, -4.0..4.0).prop_map(|(x, y, phi)| Pose::new(x, y, phi))
}

/// `c cᵀ`
fn line() -> impl Strategy<Value = Covariance3> {
    (unit(), unit(), unit()).prop_map(|(x, y, phi)| {
        let c = Vector3::new(x, y, phi);
        Covariance3::new(c * c.transpose()).unwrap()
    })
}

fn covariance() -> impl Strategy<Value = Covariance3> {
    factor().prop_map(|m| Covariance3::new(m).unwrap())
}

/// A belief with any dependent and any independent part.
fn belief() -> impl Strategy<Value = Belief> {
    (
        pose(),
        factor(),
        factor(),
        prop_oneof![1 => Just(0.0), 1 => Just(1.0), 4 => 0.0..1.0],
    )
        .prop_map(|(pose, dependent, independent, share)| {
            let parts = Parts {
                independent: Covariance3::new(independent * share).unwrap(),
                dependent: Covariance3::new(dependent * (1.0 - share)).unwrap(),
            };
            Belief::gaussian(pose, parts)
        })
}

fn message() -> impl Strategy<Value = GlobalPose> {
    belief().prop_map(|Belief { pose, parts, .. }| GlobalPose { pose, parts })
}

fn settings() -> impl Strategy<Value = FusionSettings> {
    let criterion = prop_oneof![Just(Criterion::Trace), Just(Criterion::Determinant)];
    let gate_weight = prop_oneof![Just(GateWeight::Update), Just(GateWeight::Half)];
    (criterion, gate_weight, 0.05..=1.0).prop_map(|(criterion, gate_weight, damping)| {
        FusionSettings {
            criterion,
            gate_weight,
            damping,
            gate: f64::INFINITY,
            ..FusionSettings::paper()
        }
    })
}

fn motion() -> impl Strategy<Value = Motion> {
    let velocity = [unit(), unit(), unit()];
    (velocity, covariance(), any::<bool>()).prop_map(|(velocity, noise, sideways)| {
        if sideways {
            return Motion::Holonomic { velocity, noise };
        }
        let m = noise.matrix();
        let noise = Covariance2::new(Matrix2::new(m.m11, m.m13, m.m31, m.m33)).unwrap();
        Motion::Nonholonomic {
            velocity: [velocity[0], velocity[2]],
            noise,
        }
    })
}

/// Finite, and its parts are what a peer accepts.
fn assert_valid(belief: &Belief) {
    assert!(belief.pose.is_finite(), "{belief:?}");
    let [independent, dependent] = [belief.parts.independent, belief.parts.dependent];
    let again = Parts::from_row_major(independent.to_row_major(), dependent.to_row_major());
    assert_eq!(again, Ok(belief.parts), "{belief:?}");
    let total = belief.total();
    assert_eq!(Covariance3::new(total.matrix()), Ok(total), "{belief:?}");
}

/// The dependent part that the paper makes is a difference, and goes out without what is below zero.
fn as_told(belief: &Belief) -> Belief {
    let parts = Parts::of(&belief.total(), &belief.parts.independent);
    Belief { parts, ..*belief }
}

/// `share` of it independent.
fn parts(whole: &Covariance3, share: f64) -> Parts {
    Parts {
        independent: whole.scaled(share),
        dependent: whole.scaled(1.0 - share),
    }
}

proptest! {
    #![proptest_config(config(2000))]

    #[test]
    fn every_operation_keeps_a_belief_valid(
        own in belief(), motion in motion(), sighting in (pose(), covariance()), message in message(),
        settings in settings(), at in [unit(), unit()],
    ) {
        for propagation in [Propagation::Honest, Propagation::Paper] {
            assert_valid(&as_told(&propagate(&own, &motion, 0.5, propagation)));
            let GlobalPose { pose, parts } = to_global(&own, &sighting.0, &sighting.1, propagation);
            assert_valid(&as_told(&Belief::gaussian(pose, parts)));
        }
        let fusion = fuse(&own, &message, &settings);
        assert!(fusion.accepted && fusion.d2 >= 0.0 && (0.0..=1.0).contains(&fusion.alpha), "{fusion:?}");
        assert_valid(&fusion.belief);
        let noise = Covariance2::new(sighting.1.matrix().fixed_view::<2, 2>(0, 0).into_owned()).unwrap();
        assert_valid(&fix::update(&own, at, &noise, f64::INFINITY).belief);
    }

    /// More of it is independent, and that is a sighting's noise, turned: nothing is left of it in the dependent part.
    #[test]
    fn the_noise_of_a_sighting_is_its_own_and_the_whole_is_the_same(
        own in belief(), relative in pose(), noise in covariance(),
    ) {
        let settings = Settings::default();
        let told = tell(&own, &relative, &noise, &settings);
        let by_letter = to_global(&own, &relative, &noise, Propagation::Honest);
        assert_valid(&as_told(&Belief::gaussian(told.pose, told.parts)));
        assert_eq!(told.pose, by_letter.pose);
        let (whole, same) = (told.total().matrix(), by_letter.total().matrix());
        let scale = whole.diagonal().map(f64::sqrt);
        let allowed = (scale * scale.transpose()).map(|it| 1e-13 * it + 1e-30);
        assert!((whole - same).abs().zip_map(&allowed, |error, most| error <= most).iter().all(|it| *it), "{told:?} {by_letter:?}");
        let exact = tell(&own, &relative, &Covariance3::ZERO, &settings);
        assert_eq!(told.parts.dependent, exact.parts.dependent);
        let of_paper = Settings { fusion: FusionSettings::paper(), ..settings };
        assert_eq!(tell(&own, &relative, &noise, &of_paper), by_letter);
    }

    /// What is known along a line only, or in no direction at all, told by what is known along another.
    #[test]
    fn singular_covariances_leave_no_variance_below_zero(
        own in line(), independent in 0.0..=1.0, told in line(), settings in settings(), at in [unit(), unit()],
    ) {
        let own = Belief::gaussian(Pose::default(), parts(&own, independent));
        let message = GlobalPose { pose: Pose::default(), parts: parts(&told, 1.0 - independent) };
        let noise = Covariance2::new(told.matrix().fixed_view::<2, 2>(0, 0).into_owned()).unwrap();
        for belief in [fix::update(&own, at, &noise, f64::INFINITY).belief, fuse(&own, &message, &settings).belief] {
            let Belief { parts: Parts { independent, dependent }, .. } = belief;
            let variances = [independent.variances(), dependent.variances()];
            prop_assert!(variances.iter().flatten().all(|variance| *variance >= 0.0), "{belief:?}");
        }
    }

    #[test]
    fn fusing_never_makes_the_trace_larger(own in belief(), message in message(), damping in 0.05..=1.0) {
        let settings = FusionSettings { damping, gate: f64::INFINITY, ..FusionSettings::paper() };
        let Fusion { belief, .. } = fuse(&own, &message, &settings);
        let (before, after) = (own.total().matrix().trace(), belief.total().matrix().trace());
        prop_assert!(after <= before * (1.0 + 1e-9), "{after} after {before}");
    }

    /// Between the greedy weight and no fusion at all: convexity bounds the damped cost by the chord.
    #[test]
    fn the_damped_weight_is_as_said_and_its_cost_below_the_chord(
        own in belief(), message in message(), damping in 0.05..=1.0,
    ) {
        let settings = FusionSettings { gate: f64::INFINITY, ..FusionSettings::paper() };
        let greedy = fuse(&own, &message, &settings);
        let damped = fuse(&own, &message, &FusionSettings { damping, ..settings });
        let [before, best, cost] = [own, greedy.belief, damped.belief].map(|b| b.total().matrix().trace());
        if damped.alpha.to_bits() == greedy.alpha.to_bits() {
            return Ok(()); // Nothing to weigh, or an end.
        }
        prop_assert!((damped.alpha - (1.0 - damping * (1.0 - greedy.alpha))).abs() < 1e-14);
        prop_assert!(cost <= damping * best + (1.0 - damping) * before + 1e-8 * before);
    }

    #[test]
    fn without_dependent_parts_it_is_the_kalman_filter(
        own in (pose(), covariance()), told in (pose(), covariance()), settings in settings(),
    ) {
        let belief = Belief::independent(own.0, own.1);
        let message = GlobalPose { pose: told.0, parts: Parts::independent(told.1) };
        let fusion = fuse(&belief, &message, &settings);
        let (p, r) = (own.1.matrix(), told.1.matrix());
        let Some(inverse) = regular_inverse(&(p + r)) else { return Ok(()) };
        let expected = p - p * inverse * p;
        assert_close(&fusion.belief.total(), &expected, &p);
        prop_assert_eq!(fusion.belief.parts.dependent, Covariance3::ZERO);
        let innovation = Vector3::new(
            told.0.x - own.0.x,
            told.0.y - own.0.y,
            coloc_estimator::angle::wrap(told.0.phi - own.0.phi),
        );
        let d2 = innovation.dot(&(inverse * innovation));
        prop_assert!((fusion.d2 - d2).abs() <= 1e-6 * d2);
    }

    #[test]
    fn without_independent_parts_it_is_covariance_intersection(
        own in (pose(), covariance()), told in (pose(), covariance()),
    ) {
        let belief = Belief::gaussian(own.0, Parts::dependent(own.1));
        let message = GlobalPose { pose: told.0, parts: Parts::dependent(told.1) };
        let settings = FusionSettings { gate: f64::INFINITY, ..FusionSettings::paper() };
        let fusion = fuse(&belief, &message, &settings);
        prop_assert_eq!(fusion.belief.parts.independent, Covariance3::ZERO);
        let (Some(p), Some(r)) = (regular_inverse(&own.1.matrix()), regular_inverse(&told.1.matrix())) else {
            return Ok(());
        };
        let intersection = |alpha: f64| (p * alpha + r * (1.0 - alpha)).try_inverse().unwrap();
        assert_close(&fusion.belief.total(), &intersection(fusion.alpha), &own.1.matrix());
        for alpha in [0.0, 0.1, 0.5, 0.9, 1.0, fusion.alpha - 0.01, fusion.alpha + 0.01] {
            let cost = intersection(alpha.clamp(0.0, 1.0)).trace();
            prop_assert!(fusion.belief.total().matrix().trace() <= cost * (1.0 + 1e-9));
        }
    }

    #[test]
    fn no_other_weight_is_better(
        own in belief(), message in message(), of_determinant in any::<bool>(), heading_lever_m in 0.1..=10.0,
    ) {
        let [p_i, r_i] = [own.parts, message.parts].map(|it| it.independent.matrix());
        let [p_d, r_d] = [own.parts, message.parts].map(|it| it.dependent.matrix());
        if regular_inverse(&p_d).and(regular_inverse(&r_d)).is_none() {
            return Ok(());
        }
        let criterion = if of_determinant { Criterion::Determinant } else { Criterion::Trace };
        let trace = |p: &Matrix3<f64>| p.m11 + p.m22 + heading_lever_m * heading_lever_m * p.m33;
        let measure = |p: &Matrix3<f64>| if of_determinant { p.determinant() } else { trace(p) };
        let cost = |alpha: f64| {
            let (p1, p2) = (p_d / alpha + p_i, r_d / (1.0 - alpha) + r_i);
            measure(&(p2 * (p1 + p2).try_inverse().unwrap() * p1))
        };
        let settings = FusionSettings { criterion, heading_lever_m, gate: f64::INFINITY, ..FusionSettings::paper() };
        let found = measure(&fuse(&own, &message, &settings).belief.total().matrix());
        for alpha in (1..100).map(|percent| f64::from(percent) / 100.0) {
            prop_assert!(found <= cost(alpha) * (1.0 + 1e-6), "{found} but {} at {alpha}", cost(alpha));
        }
    }

    #[test]
    fn a_fix_is_the_kalman_filters_update(own in belief(), at in [unit(), unit()], r in [scale(), scale()]) {
        let noise = Covariance2::diagonal(r).unwrap();
        let updated = fix::update(&own, at, &noise, f64::INFINITY);
        let p = own.total().matrix();
        let s = p.fixed_view::<2, 2>(0, 0) + noise.matrix();
        let correlation = s.m12 * s.m12 / (s.m11 * s.m22);
        prop_assume!(correlation < 1.0 - 1e-6);
        let Some(inverse) = s.try_inverse() else { return Ok(()) };
        let gain = p.fixed_view::<3, 2>(0, 0) * inverse;
        assert_close(&updated.belief.total(), &(p - gain * p.fixed_view::<2, 3>(0, 0)), &p);
        let innovation = Vector2::new(at[0] - own.pose.x, at[1] - own.pose.y);
        let x = own.pose.x + (gain * innovation).x;
        prop_assert!((updated.belief.pose.x - x).abs() < 1e-6);
    }
}

/// Equal to a hundred-millionth of the σ that `scale` gives.
fn assert_close(found: &Covariance3, expected: &Matrix3<f64>, scale: &Matrix3<f64>) {
    for i in 0..3 {
        for j in 0..3 {
            let allowed = 1e-8 * (scale[(i, i)] * scale[(j, j)]).sqrt() + 1e-14;
            let error = found.matrix()[(i, j)] - expected[(i, j)];
            assert!(
                error.abs() <= allowed,
                "[{i}][{j}] off by {error:e}, {allowed:e} allowed"
            );
        }
    }
}

/// The inverse of a matrix that is far enough from singular for the plain formulas.
fn regular_inverse(m: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let product = m.m11 * m.m22 * m.m33;
    (m.determinant() > 1e-6 * product)
        .then(|| m.try_inverse())
        .flatten()
}

/// 10⁵ random steps of everything that happens to a belief, fed back into itself.
#[test]
fn a_belief_stays_valid_over_a_hundred_thousand_steps() {
    let mut runner = TestRunner::new(config(1));
    let mut draw =
        |strategy: &BoxedStrategy<f64>| strategy.new_tree(&mut runner).unwrap().current();
    let (part, angle) = ((0.0..1.0).boxed(), (-3.0..3.0).boxed());
    let mut own = Belief::independent(Pose::default(), Covariance3::diagonal([1e-4; 3]).unwrap());
    let mut neighbour = own;
    let sighting = Covariance3::diagonal([0.01, 0.01, 3e-4]).unwrap();
    let position = Covariance2::diagonal([0.01, 0.01]).unwrap();
    let settings = [FusionSettings::default(), FusionSettings::paper()];
    for step in 0..100_000 {
        let velocity = [draw(&part), draw(&angle)];
        let noise = Covariance2::diagonal([5.075 * velocity[0] * velocity[0], 0.345]).unwrap();
        let propagation = [Propagation::Honest, Propagation::Paper][usize::from(step % 200 > 150)];
        let motion = Motion::Nonholonomic { velocity, noise };
        own = propagate(&own, &motion, 0.02, propagation);
        let event = draw(&part);
        if event < 0.2 {
            let relative = Pose::new(draw(&angle), draw(&angle), draw(&angle));
            let mut told = to_global(&neighbour, &relative, &sighting, propagation);
            told.pose = own.pose;
            own = fuse(&own, &told, &settings[step % 2]).belief;
        }
        if event < 0.1 {
            own.make_dependent();
        }
        if event > 0.98 {
            own = fix::update(&own, [own.pose.x, own.pose.y], &position, 9.0).belief;
        }
        assert_valid(&as_told(&own));
        core::mem::swap(&mut own, &mut neighbour);
    }
}
