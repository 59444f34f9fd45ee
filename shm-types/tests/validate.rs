//! Every reason, every boundary, every scale.
use coloc_shm_types::{
    Estimate, Header, Limits, Neighbour, Position, Reject, RelativePose, Status,
};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const NOW_NS: i64 = 1_000_000;
const HISTORY_NS: i64 = 10_000;
const TOLERANCE_NS: i64 = 100;

const LIMITS: Limits = Limits {
    now_ns: NOW_NS,
    history_ns: HISTORY_NS,
    future_tolerance_ns: TOLERANCE_NS,
    set_back_ns: 0,
    own: 1,
    robots: &[1, 2, 3],
};

const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
const HALF: [f64; 9] = [0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.5];
/// Correlation −2 between x and y.
const INDEFINITE: [f64; 9] = [1.0, -2.0, 0.0, -2.0, 1.0, 0.0, 0.0, 0.0, 1.0];
const ASYMMETRIC: [f64; 9] = [1.0, 0.1, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0, 1.0];

fn at(stamp_ns: i64) -> Header {
    Header {
        stamp_ns,
        session_ns: 0,
        sequence: 0,
    }
}

fn sighting() -> RelativePose {
    RelativePose {
        header: at(NOW_NS),
        observed: 2,
        covariance: IDENTITY,
        ..RelativePose::default()
    }
}

fn fix() -> Position {
    Position {
        header: at(NOW_NS),
        quality: 2,
        covariance: [1.0, 0.0, 0.0, 1.0],
        ..Position::default()
    }
}

fn neighbour() -> Neighbour {
    Neighbour {
        header: at(NOW_NS),
        sender: 2,
        total: IDENTITY,
        independent: HALF,
        ..Neighbour::default()
    }
}

fn estimate() -> Estimate {
    Estimate {
        header: at(NOW_NS),
        robot: 1,
        total: IDENTITY,
        independent: HALF,
        ..Estimate::default()
    }
}

fn status() -> Status {
    Status {
        header: at(NOW_NS),
        robot: 1,
        ..Status::default()
    }
}

#[test]
fn what_is_in_order_passes() {
    assert_eq!(sighting().validate(&LIMITS), Ok(()));
    assert_eq!(fix().validate(&LIMITS), Ok(()));
    assert_eq!(neighbour().validate(&LIMITS), Ok(()));
    assert_eq!(estimate().validate(&LIMITS), Ok(()));
    assert_eq!(status().validate(&LIMITS), Ok(()));
}

/// Every field of numbers, made NaN, infinite and unreasonably large.
#[test]
fn every_number_must_be_finite() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e61, -1e61] {
        for place in 0..3 {
            let (mut sighting, mut neighbour) = (sighting(), neighbour());
            let (mut estimate, mut moving) = (estimate(), estimate());
            sighting.pose[place] = bad;
            neighbour.pose[place] = bad;
            estimate.pose[place] = bad;
            moving.velocity[place] = bad;
            assert_eq!(sighting.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(neighbour.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(estimate.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(moving.validate(&LIMITS), Err(Reject::NotFinite));
        }
        for place in 0..9 {
            let (mut sighting, mut neighbour, mut estimate) = (sighting(), neighbour(), estimate());
            sighting.covariance[place] = bad;
            neighbour.total[place] = bad;
            estimate.independent[place] = bad;
            assert_eq!(sighting.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(neighbour.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(estimate.validate(&LIMITS), Err(Reject::NotFinite));
        }
        for place in 0..4 {
            let (mut moved, mut spread) = (fix(), fix());
            moved.position[place % 2] = bad;
            spread.covariance[place] = bad;
            assert_eq!(moved.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(spread.validate(&LIMITS), Err(Reject::NotFinite));
        }
    }
}

#[test]
fn covariances_must_be_covariances() {
    for (matrix, reason) in [
        (ASYMMETRIC, Reject::Asymmetric),
        (INDEFINITE, Reject::NotPositiveSemidefinite),
    ] {
        let covariance = [matrix[0], matrix[1], matrix[3], matrix[4]];
        assert_eq!(
            RelativePose {
                covariance: matrix,
                ..sighting()
            }
            .validate(&LIMITS),
            Err(reason)
        );
        assert_eq!(
            Position {
                covariance,
                ..fix()
            }
            .validate(&LIMITS),
            Err(reason)
        );
        assert_eq!(
            Neighbour {
                total: matrix,
                ..neighbour()
            }
            .validate(&LIMITS),
            Err(reason)
        );
        assert_eq!(
            Neighbour {
                independent: matrix,
                ..neighbour()
            }
            .validate(&LIMITS),
            Err(reason)
        );
        assert_eq!(
            Estimate {
                total: matrix,
                ..estimate()
            }
            .validate(&LIMITS),
            Err(reason)
        );
        assert_eq!(
            Estimate {
                independent: matrix,
                ..estimate()
            }
            .validate(&LIMITS),
            Err(reason)
        );
    }
}

#[test]
fn a_negative_variance_is_not_positive_semidefinite() {
    for place in [0, 4, 8] {
        let mut covariance = IDENTITY;
        covariance[place] = -1e-12;
        let sighting = RelativePose {
            covariance,
            ..sighting()
        };
        assert_eq!(
            sighting.validate(&LIMITS),
            Err(Reject::NotPositiveSemidefinite)
        );
    }
}

#[test]
fn what_does_not_vary_does_not_covary() {
    let mut covariance = IDENTITY;
    covariance[0] = 0.0;
    assert_eq!(
        RelativePose {
            covariance,
            ..sighting()
        }
        .validate(&LIMITS),
        Ok(())
    );
    (covariance[1], covariance[3]) = (1e-6, 1e-6);
    let refused = RelativePose {
        covariance,
        ..sighting()
    }
    .validate(&LIMITS);
    assert_eq!(refused, Err(Reject::NotPositiveSemidefinite));
}

#[test]
fn the_independent_part_may_be_nothing_or_everything_and_no_more() {
    for independent in [[0.0; 9], IDENTITY] {
        assert_eq!(
            Neighbour {
                independent,
                ..neighbour()
            }
            .validate(&LIMITS),
            Ok(())
        );
    }
    let independent = IDENTITY.map(|entry| entry * 1.001);
    let reason = Err(Reject::DependentNotPositiveSemidefinite);
    assert_eq!(
        Neighbour {
            independent,
            ..neighbour()
        }
        .validate(&LIMITS),
        reason
    );
    assert_eq!(
        Estimate {
            independent,
            ..estimate()
        }
        .validate(&LIMITS),
        reason
    );
}

#[test]
fn robots_must_be_known_and_others() {
    for (robot, expected) in [
        (2, Ok(())),
        (3, Ok(())),
        (1, Err(Reject::UnknownRobot)),
        (4, Err(Reject::UnknownRobot)),
    ] {
        assert_eq!(
            RelativePose {
                observed: robot,
                ..sighting()
            }
            .validate(&LIMITS),
            expected
        );
        assert_eq!(
            Neighbour {
                sender: robot,
                ..neighbour()
            }
            .validate(&LIMITS),
            expected
        );
    }
    assert_eq!(
        Estimate {
            robot: 9,
            ..estimate()
        }
        .validate(&LIMITS),
        Err(Reject::UnknownRobot)
    );
    assert_eq!(
        Status {
            robot: 9,
            ..status()
        }
        .validate(&LIMITS),
        Err(Reject::UnknownRobot)
    );
}

#[test]
fn stamps_lie_between_the_history_and_the_future() {
    for (stamp_ns, expected) in [
        (NOW_NS + TOLERANCE_NS, Ok(())),
        (NOW_NS + TOLERANCE_NS + 1, Err(Reject::FromFuture)),
        (i64::MAX, Err(Reject::FromFuture)),
        (NOW_NS - HISTORY_NS, Ok(())),
        (NOW_NS - HISTORY_NS - 1, Err(Reject::TooOld)),
        (i64::MIN, Err(Reject::TooOld)),
    ] {
        let header = at(stamp_ns);
        assert_eq!(
            RelativePose {
                header,
                ..sighting()
            }
            .validate(&LIMITS),
            expected
        );
        assert_eq!(Position { header, ..fix() }.validate(&LIMITS), expected);
        assert_eq!(
            Neighbour {
                header,
                ..neighbour()
            }
            .validate(&LIMITS),
            expected
        );
        assert_eq!(
            Estimate {
                header,
                ..estimate()
            }
            .validate(&LIMITS),
            expected
        );
        assert_eq!(Status { header, ..status() }.validate(&LIMITS), expected);
    }
}

#[test]
fn a_session_from_the_future_is_refused() {
    let header = Header {
        session_ns: NOW_NS + TOLERANCE_NS + 1,
        ..at(NOW_NS)
    };
    assert_eq!(
        Position { header, ..fix() }.validate(&LIMITS),
        Err(Reject::FromFuture)
    );
}

#[test]
fn limits_at_the_ends_of_time_do_not_overflow() {
    for now_ns in [i64::MIN, i64::MAX] {
        let limits = Limits {
            now_ns,
            history_ns: i64::MAX,
            future_tolerance_ns: i64::MAX,
            set_back_ns: 0,
            ..LIMITS
        };
        let header = Header {
            session_ns: now_ns,
            ..at(now_ns)
        };
        assert_eq!(Position { header, ..fix() }.validate(&limits), Ok(()));
    }
}

#[test]
fn only_measured_fixes_count() {
    for quality in 0..=255 {
        let expected = if (1..=5).contains(&quality) {
            Ok(())
        } else {
            Err(Reject::BadQuality)
        };
        assert_eq!(Position { quality, ..fix() }.validate(&LIMITS), expected);
    }
}

/// One message with every fault; they are mended one by one, and each mending shows the next reason.
#[test]
fn of_several_reasons_the_first_is_named() {
    let mut message = Neighbour {
        pose: [f64::NAN, 0.0, 0.0],
        total: ASYMMETRIC,
        independent: INDEFINITE,
        sender: 9,
        header: at(i64::MAX),
        ..Neighbour::default()
    };
    let mut next = |reason: Reject, mend: fn(&mut Neighbour)| {
        assert_eq!(message.validate(&LIMITS), Err(reason));
        mend(&mut message);
    };
    next(Reject::NotFinite, |message| message.pose[0] = 0.0);
    next(Reject::Asymmetric, |message| message.total = HALF);
    next(Reject::NotPositiveSemidefinite, |message| {
        message.independent = IDENTITY;
    });
    next(Reject::DependentNotPositiveSemidefinite, |message| {
        message.independent = [0.0; 9];
    });
    next(Reject::UnknownRobot, |message| message.sender = 2);
    next(Reject::FromFuture, |message| message.header = at(0));
    next(Reject::TooOld, |message| message.header = at(NOW_NS));
    assert_eq!(message.validate(&LIMITS), Ok(()));
}

type Matrix = [[f64; 3]; 3];

fn flat(matrix: Matrix) -> [f64; 9] {
    matrix.as_flattened().try_into().expect("nine")
}

fn from_fn(entry: impl Fn(usize, usize) -> f64) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

/// A Aᵀ of the first `rank` columns of `a`, in coordinates scaled by `units`.
fn covariance(a: Matrix, rank: usize, units: [f64; 3]) -> Matrix {
    from_fn(|i, j| (0..rank).map(|k| a[i][k] * a[j][k]).sum::<f64>() * units[i] * units[j])
}

fn sighting_with(covariance: Matrix) -> Result<(), Reject> {
    RelativePose {
        covariance: flat(covariance),
        ..sighting()
    }
    .validate(&LIMITS)
}

fn split(total: Matrix, independent: Matrix) -> Result<(), Reject> {
    Neighbour {
        total: flat(total),
        independent: flat(independent),
        ..neighbour()
    }
    .validate(&LIMITS)
}

prop_compose! {
    fn entries()(a in prop::array::uniform3(prop::array::uniform3(-1.0..1.0))) -> Matrix { a }
}

prop_compose! {
    /// Standard deviations of 1e-6 to 1e+3, each coordinate its own.
    fn units()(exponents in prop::array::uniform3(-6.0..3.0)) -> [f64; 3] {
        exponents.map(|exponent: f64| 10_f64.powf(exponent))
    }
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn covariances_of_every_rank_and_unit_pass(a in entries(), rank in 0_usize..=3, units in units()) {
        prop_assert_eq!(sighting_with(covariance(a, rank, units)), Ok(()));
    }

    #[test]
    fn a_negative_eigenvalue_is_found_in_every_unit(a in entries(), units in units(), depth in 1e-4..1.0) {
        let singular = covariance(a, 2, [1.0; 3]);
        // Across the two columns: the direction in which the covariance has nothing.
        let normal: [f64; 3] = std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            a[j][0] * a[k][1] - a[k][0] * a[j][1]
        });
        prop_assume!(normal.iter().all(|entry| entry.abs() > 0.03));
        let negative = from_fn(|i, j| {
            (singular[i][j] - depth * normal[i] * normal[j]) * units[i] * units[j]
        });
        prop_assert_eq!(sighting_with(negative), Err(Reject::NotPositiveSemidefinite));
    }

    #[test]
    fn an_asymmetry_is_found_in_every_unit(a in entries(), units in units(), place in 0_usize..3, part in 1e-6..1.0) {
        let mut matrix = covariance(a, 3, units);
        let (i, j) = (place, (place + 1) % 3);
        let deviations = matrix[i][i].sqrt() * matrix[j][j].sqrt();
        prop_assume!(deviations > 0.0);
        matrix[i][j] += part * deviations;
        prop_assert_eq!(sighting_with(matrix), Err(Reject::Asymmetric));
    }

    #[test]
    fn any_share_of_the_total_may_be_independent(a in entries(), units in units(), share in 0.0..=1.0) {
        let total = covariance(a, 3, units);
        let independent = from_fn(|i, j| share * total[i][j]);
        prop_assert_eq!(split(total, independent), Ok(()));
    }

    #[test]
    fn more_than_the_total_is_found_in_every_unit(a in entries(), units in units(), share in 1.00001..10.0) {
        let total = covariance(a, 3, units);
        prop_assume!((0..3).all(|i| total[i][i] > 0.0));
        let independent = from_fn(|i, j| share * total[i][j]);
        prop_assert_eq!(split(total, independent), Err(Reject::DependentNotPositiveSemidefinite));
    }

    /// Whatever the bytes are, there is an answer; and what passes is finite.
    #[test]
    fn no_bytes_can_do_harm(
        numbers in prop::array::uniform21(any::<u64>().prop_map(f64::from_bits)),
        stamp_ns in any::<i64>(), session_ns in any::<i64>(), sender in any::<u16>(),
    ) {
        let header = Header { stamp_ns, session_ns, sequence: 0 };
        let mut message = Neighbour { header, sender, ..Neighbour::default() };
        message.pose.copy_from_slice(&numbers[..3]);
        message.total.copy_from_slice(&numbers[3..12]);
        message.independent.copy_from_slice(&numbers[12..]);
        if message.validate(&LIMITS).is_ok() {
            prop_assert!(numbers.iter().all(|number| number.is_finite()));
        }
    }
}
