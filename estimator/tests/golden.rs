//! Golden numbers: small cases with results to twelve digits, worked out by hand-written reference code. They need
//! no files, so that the mathematics is tested wherever the crate is.

#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

use coloc_estimator::settings::{Criterion, FusionSettings};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, GlobalPose, Motion, Parts, Pose, Propagation, fuse,
    propagate, to_global,
};

/// `[xx, xy, xφ, yy, yφ, φφ]`
type Triangle = [f64; 6];

fn covariance([xx, xy, xp, yy, yp, pp]: Triangle) -> Covariance3 {
    Covariance3::from_row_major([xx, xy, xp, xy, yy, yp, xp, yp, pp]).unwrap()
}

fn assert_pose(found: Pose, [x, y, phi]: [f64; 3]) {
    for (found, expected) in [(found.x, x), (found.y, y), (found.phi, phi)] {
        assert!(
            (found - expected).abs() < 1e-11,
            "{found} is not {expected}"
        );
    }
}

fn assert_covariance(found: &Covariance3, expected: Triangle) {
    let [xx, xy, xp, _, yy, yp, _, _, pp] = found.to_row_major();
    for (found, expected) in [xx, xy, xp, yy, yp, pp].into_iter().zip(expected) {
        assert!(
            (found - expected).abs() < 1e-11,
            "{found} is not {expected}"
        );
    }
}

/// TV0
fn prior() -> Belief {
    let covariance = covariance([0.04, 0.006, 0.002, 0.09, -0.003, 0.01]);
    Belief::independent(Pose::new(1.0, 2.0, 0.5), covariance)
}

#[test]
fn tv1_without_sideways_velocity() {
    let noise = Covariance2::diagonal([0.05 * 0.05, 0.1 * 0.1]).unwrap();
    let motion = Motion::Nonholonomic {
        velocity: [0.5, 0.2],
        noise,
    };
    let tick = propagate(&prior(), &motion, 0.02, Propagation::Paper);
    assert_pose(tick.pose, [1.008_732_121_046, 2.004_770_379_469, 0.504]);
    assert_covariance(
        &tick.total(),
        [
            0.039_981_828_158,
            0.006_031_942_071,
            0.001_952_438_575,
            0.089_948_340_467,
            -0.002_912_939_396,
            0.010_004,
        ],
    );
    assert_eq!(tick.parts.dependent, Covariance3::ZERO);
    let second = propagate(&prior(), &motion, 1.0, Propagation::Paper);
    assert_pose(second.pose, [1.436_606_052_301, 2.238_518_973_453, 0.7]);
    assert_covariance(
        &second.total(),
        [
            0.041_550_183_227,
            0.007_623_091_464,
            -0.000_378_071_238,
            0.089_842_425_326,
            0.001_353_030_202,
            0.02,
        ],
    );
}

#[test]
fn tv2_with_sideways_velocity() {
    let noise = Covariance3::diagonal([0.05 * 0.05, 0.03 * 0.03, 0.1 * 0.1]).unwrap();
    let motion = Motion::Holonomic {
        velocity: [0.5, 0.1, 0.2],
        noise,
    };
    let tick = propagate(&prior(), &motion, 0.02, Propagation::Paper);
    assert_pose(tick.pose, [1.007_778_076_188, 2.006_516_829_682, 0.504]);
    assert_covariance(
        &tick.total(),
        [
            0.039_975_085_81,
            0.006_035_051_227,
            0.001_935_130_281,
            0.089_954_215_578,
            -0.002_922_575_602,
            0.010_004,
        ],
    );
}

#[test]
fn tv3_sighting_in_the_common_frame() {
    let degree = 1.0_f64.to_radians();
    let noise = Covariance3::diagonal([0.05 * 0.05, 0.05 * 0.05, degree * degree]).unwrap();
    let seen = to_global(
        &prior(),
        &Pose::new(3.0, -1.0, 0.3),
        &noise,
        Propagation::Paper,
    );
    assert_pose(seen.pose, [4.096_686_617_028, 2.557_903_962_249, 0.8]);
    assert_covariance(
        &seen.total(),
        [
            0.044_477_562_298,
            -0.003_008_365_738,
            -0.003_553_478_459,
            0.168_884_334_911,
            0.027_824_987_067,
            0.010_304_617_42,
        ],
    );
}

/// The same three by quadrature over the heading: what is exact, to twelve digits.
#[test]
fn tv8_honestly() {
    let quiet = Covariance2::diagonal([0.05 * 0.05, 0.1 * 0.1]).unwrap();
    let ahead = Motion::Nonholonomic {
        velocity: [0.5, 0.2],
        noise: quiet,
    };
    let second = propagate(&prior(), &ahead, 1.0, Propagation::Honest);
    assert_pose(second.pose, [1.409_925_610_908, 2.280_445_199_104, 0.7]);
    assert_covariance(
        &second.total(),
        [
            0.041_581_755_145,
            0.007_363_869_115,
            -0.002_275_044_512,
            0.090_431_461_468,
            0.003_102_112_107,
            0.02,
        ],
    );
    let noise = Covariance3::diagonal([0.05 * 0.05, 0.03 * 0.03, 0.1 * 0.1]).unwrap();
    let aside = Motion::Holonomic {
        velocity: [0.5, 0.1, 0.2],
        noise,
    };
    let second = propagate(&prior(), &aside, 1.0, Propagation::Honest);
    assert_pose(second.pose, [1.353_836_571_087, 2.362_430_321_286, 0.7]);
    assert_covariance(
        &second.total(),
        [
            0.042_200_721_824,
            0.006_930_826_257,
            -0.003_495_466_934,
            0.090_842_207_468,
            0.002_247_103_204,
            0.02,
        ],
    );
}

#[test]
fn tv9_sighting_honestly() {
    let degree = 1.0_f64.to_radians();
    let noise = Covariance3::diagonal([0.05 * 0.05, 0.05 * 0.05, degree * degree]).unwrap();
    let relative = Pose::new(3.0, -1.0, 0.3);
    let seen = to_global(&prior(), &relative, &noise, Propagation::Honest);
    assert_pose(seen.pose, [4.096_651_195_563, 2.557_897_580_662, 0.8]);
    assert_covariance(
        &seen.total(),
        [
            0.043_860_425_085,
            -0.003_323_053_475,
            -0.003_578_975_807,
            0.169_829_739_928,
            0.027_966_511_956,
            0.010_304_617_42,
        ],
    );
}

const TV5: Triangle = [0.10, 0.01, 0.002, 0.08, 0.0, 0.02];

fn tv5(own_part: f64, received_part: f64) -> (Belief, GlobalPose) {
    let (total, message) = (
        covariance(TV5),
        Covariance3::diagonal([0.06, 0.05, 0.01]).unwrap(),
    );
    let parts = |whole: Covariance3, share: f64| Parts {
        independent: whole.scaled(share),
        dependent: whole.scaled(1.0 - share),
    };
    let own = Belief::gaussian(Pose::new(1.0, 2.0, 3.1), parts(total, own_part));
    let pose = Pose::new(1.2, 1.9, -3.1);
    (
        own,
        GlobalPose {
            pose,
            parts: parts(message, received_part),
        },
    )
}

/// TV5's weight of ½ from the optimum α*: `1 − β (1 − α*) = ½` for `β = ½/(1 − α*)`.
#[test]
fn tv5_split_covariance_intersection_at_one_half() {
    let (own, message) = tv5(0.4, 0.25);
    let greedy = FusionSettings::paper();
    let best = fuse(&own, &message, &greedy).alpha;
    let half = fuse(
        &own,
        &message,
        &FusionSettings {
            damping: 0.5 / (1.0 - best),
            ..greedy
        },
    );
    assert!((half.alpha - 0.5).abs() < 1e-15);
    assert!((half.d2 - 0.341_061_626_020).abs() < 1e-11);
    assert_pose(
        half.belief.pose,
        [1.119_520_059_225, 1.945_582_672_283, -3.128_541_823_042],
    );
    assert_covariance(
        &half.belief.total(),
        [
            0.063_176_090_018,
            0.002_587_712_915,
            0.000_450_627_986,
            0.051_812_051_792,
            -0.000_027_881_082,
            0.011_308_276_062,
        ],
    );
    assert_covariance(
        &half.belief.parts.independent,
        [
            0.011_711_907_96,
            0.000_316_014_087,
            0.000_052_496_496,
            0.009_659_046_238,
            -0.000_004_460_967,
            0.002_043_939_788,
        ],
    );
}

#[test]
fn tv6_optimal_weights() {
    let (own, message) = tv5(0.4, 0.25);
    let trace = fuse(&own, &message, &FusionSettings::paper());
    assert!((trace.alpha - 0.168_590).abs() < 1e-6, "{}", trace.alpha);
    assert!((trace.belief.total().matrix().trace() - 0.117_454_490).abs() < 1e-9);
    let criterion = Criterion::Determinant;
    let determinant = fuse(
        &own,
        &message,
        &FusionSettings {
            criterion,
            ..FusionSettings::paper()
        },
    );
    assert!(
        (determinant.alpha - 0.141_805).abs() < 1e-6,
        "{}",
        determinant.alpha
    );
    assert!((determinant.belief.total().matrix().determinant() - 2.868_807e-5).abs() < 1e-11);
}

#[test]
fn tv7_kalman_filter() {
    let (own, message) = tv5(1.0, 1.0);
    let fusion = fuse(&own, &message, &FusionSettings::default());
    assert!((fusion.d2 - 0.564_427_137_325).abs() < 1e-11);
    assert_pose(
        fusion.belief.pose,
        [1.123_764_973_556, 1.943_348_399_131, -3.126_881_379_877],
    );
    assert_covariance(
        &fusion.belief.total(),
        [
            0.037_372_356_885,
            0.001_450_489_943,
            0.000_251_418_257,
            0.030_676_250_645,
            -0.000_016_116_555,
            0.006_663_873_13,
        ],
    );
}
