//! Every reason, every boundary, every scale.
use coloc_shm_types::{
    BeliefState, Clock, Estimate, Gyro, Header, Heading, Limits, Neighbour, Odometry, OdometryKind,
    Pose, Position, Present, Reject, RelativePose, Status, Unfit,
};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const NOW_NS: i64 = 1_000_000;
const HISTORY_NS: i64 = 10_000;
const TOLERANCE_NS: i64 = 100;
const BOOT: u64 = 7;

const LIMITS: Limits = Limits {
    now: Present::only(Clock::Boottime, NOW_NS),
    boot: BOOT,
    history_ns: HISTORY_NS,
    future_tolerance_ns: TOLERANCE_NS,
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
        boot: BOOT,
        ..Header::default()
    }
}

fn from(source: u16) -> Header {
    Header {
        source,
        ..at(NOW_NS)
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
        header: from(2),
        independent: HALF,
        dependent: HALF,
        ..Neighbour::default()
    }
}

fn heading() -> Heading {
    Heading {
        header: from(0),
        what: Heading::ANTENNAS,
        quality: 4,
        variance: 1.0,
        ..Heading::default()
    }
}

/// A sensor that has none says so, and none that has one is as certain as zero.
#[test]
fn a_heading_is_one_only_if_the_sensor_has_it() {
    for quality in [0, 6, 255] {
        let looking = Heading {
            quality,
            ..heading()
        };
        assert_eq!(looking.validate(&LIMITS), Err(Reject::BadQuality));
    }
    let exact = Heading {
        variance: 0.0,
        ..heading()
    };
    assert_eq!(exact.validate(&LIMITS), Err(Reject::NoCovariance));
    for change in [
        |it: &mut Heading| it.variance = -1.0,
        |it: &mut Heading| it.slow_sigma_rad = -1.0,
        |it: &mut Heading| it.slow_time_s = -1.0,
    ] {
        let mut looking = heading();
        change(&mut looking);
        assert_eq!(
            looking.validate(&LIMITS),
            Err(Reject::NotPositiveSemidefinite)
        );
    }
}

fn gyro() -> Gyro {
    Gyro {
        header: at(NOW_NS),
        rate_radps: -0.3,
        ..Gyro::default()
    }
}

#[test]
fn a_yaw_rate_is_a_number_and_its_noise_none_below_zero() {
    assert_eq!(gyro().validate(&LIMITS), Ok(()));
    let of = |rate_radps, noise, reserved| {
        let told = Gyro {
            rate_radps,
            noise,
            reserved: [reserved; 8],
            ..gyro()
        };
        told.validate(&LIMITS)
    };
    assert_eq!(of(f64::NAN, 0.0, 0), Err(Reject::NotFinite));
    assert_eq!(of(0.1, f64::INFINITY, 0), Err(Reject::NotFinite));
    assert_eq!(of(0.1, -1e-9, 0), Err(Reject::NoCovariance));
    assert_eq!(of(0.1, 1e-9, 0), Ok(()));
    assert!(of(0.1, 0.0, 1).is_err());
}

fn pose() -> Pose {
    Pose {
        header: at(NOW_NS),
        set: Pose::SET,
        covariance: IDENTITY,
        ..Pose::default()
    }
}

fn estimate() -> Estimate {
    Estimate {
        header: from(1),
        independent: HALF,
        dependent: HALF,
        ..Estimate::default()
    }
}

fn odometry() -> Odometry {
    Odometry {
        header: at(NOW_NS),
        values: [0.5, 0.0, 0.1, 0.0],
        ..Odometry::default()
    }
}

fn status() -> Status {
    Status {
        header: from(1),
        ..Status::default()
    }
}

#[test]
fn what_is_in_order_passes() {
    assert_eq!(sighting().validate(&LIMITS), Ok(()));
    assert_eq!(fix().validate(&LIMITS), Ok(()));
    assert_eq!(neighbour().validate(&LIMITS), Ok(()));
    assert_eq!(pose().validate(&LIMITS), Ok(()));
    assert_eq!(heading().validate(&LIMITS), Ok(()));
    let lever_m = [-999.0, 0.1];
    assert_eq!(Position { lever_m, ..fix() }.validate(&LIMITS), Ok(()));
    assert_eq!(odometry().validate(&LIMITS), Ok(()));
    assert_eq!(estimate().validate(&LIMITS), Ok(()));
    assert_eq!(status().validate(&LIMITS), Ok(()));
}

/// Every field of numbers, made NaN, infinite and unreasonably large.
#[test]
fn every_number_must_be_finite() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e61, -1e61] {
        let changes: [fn(&mut Heading, f64); 4] = [
            |it, bad| it.heading = bad,
            |it, bad| it.variance = bad,
            |it, bad| it.slow_sigma_rad = bad,
            |it, bad| it.slow_time_s = bad,
        ];
        for change in changes {
            let mut looking = heading();
            change(&mut looking, bad);
            assert_eq!(looking.validate(&LIMITS), Err(Reject::NotFinite));
        }
        for place in 0..3 {
            let (mut sighting, mut neighbour, mut said) = (sighting(), neighbour(), pose());
            let [mut estimate, mut driven, mut moving] = [estimate(); 3];
            sighting.pose[place] = bad;
            neighbour.pose[place] = bad;
            said.pose[place] = bad;
            estimate.pose[place] = bad;
            driven.odometry[place] = bad;
            moving.velocity[place] = bad;
            assert_eq!(sighting.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(neighbour.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(said.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(estimate.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(driven.validate(&LIMITS), Err(Reject::NotFinite));
            assert_eq!(moving.validate(&LIMITS), Err(Reject::NotFinite));
        }
        for place in 0..9 {
            let (mut sighting, mut neighbour, mut estimate) = (sighting(), neighbour(), estimate());
            let mut said = pose();
            said.covariance[place] = bad;
            assert_eq!(said.validate(&LIMITS), Err(Reject::NotFinite));
            sighting.covariance[place] = bad;
            neighbour.dependent[place] = bad;
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

/// What comes of a message for each of its covariances, all others being in order.
fn reasons_for(covariance: [f64; 9]) -> [Reject; 9] {
    let [xx, xy, _, yx, yy, ..] = covariance;
    let (mut seen, mut near) = (sighting(), [neighbour(); 2]);
    let mut said = pose();
    let (mut own, mut place, mut wheels) = ([estimate(); 3], fix(), odometry());
    seen.covariance = covariance;
    said.covariance = covariance;
    place.covariance = [xx, xy, yx, yy];
    wheels.covariance = covariance;
    near[0].independent = covariance;
    near[1].dependent = covariance;
    own[0].independent = covariance;
    own[1].dependent = covariance;
    own[2].velocity_covariance = covariance;
    [
        seen.validate(&LIMITS),
        said.validate(&LIMITS),
        place.validate(&LIMITS),
        wheels.validate(&LIMITS),
        near[0].validate(&LIMITS),
        own[0].validate(&LIMITS),
        own[2].validate(&LIMITS),
        near[1].validate(&LIMITS),
        own[1].validate(&LIMITS),
    ]
    .map(Result::unwrap_err)
}

#[test]
fn covariances_must_be_covariances() {
    assert_eq!(reasons_for(ASYMMETRIC), [Reject::Asymmetric; 9]);
    let [alone @ .., near, own] = reasons_for(INDEFINITE);
    assert_eq!(alone, [Reject::NotPositiveSemidefinite; 7]);
    assert_eq!([near, own], [Reject::DependentNotPositiveSemidefinite; 2]);
}

/// A beam along x that is turned by 1e-308 rad: its variance across is too small for a number, its covariance is not.
#[test]
fn a_variance_too_small_for_a_number_may_leave_a_covariance() {
    let mut estimate = estimate();
    estimate.independent = [1.0, -1e-308, 0.0, -1e-308, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(estimate.validate(&LIMITS), Ok(()));
    for place in [1, 3] {
        estimate.independent[place] = -1e-158;
    }
    assert_eq!(
        estimate.validate(&LIMITS),
        Err(Reject::NotPositiveSemidefinite)
    );
}

#[test]
fn a_negative_variance_is_not_positive_semidefinite() {
    for place in [0, 4] {
        let mut covariance = IDENTITY;
        covariance[place] = -1e-6;
        let [alone @ .., near, own] = reasons_for(covariance);
        assert_eq!(alone, [Reject::NotPositiveSemidefinite; 7]);
        assert_eq!([near, own], [Reject::DependentNotPositiveSemidefinite; 2]);
        covariance[place] = -1e-12;
        let mut seen = sighting();
        seen.covariance = covariance;
        assert_eq!(seen.validate(&LIMITS), Err(Reject::NotPositiveSemidefinite));
    }
}

/// Subtracting an independent part that is all of it leaves its rounding.
#[test]
fn a_dependent_part_may_be_the_rounding_of_nothing() {
    let mut near = neighbour();
    near.dependent = [-1e-17, 1e-17, 0.0, 1e-17, 0.0, 0.0, 0.0, 0.0, 1e-18];
    assert_eq!(near.validate(&LIMITS), Ok(()));
}

/// Many drivers send zeros where they do not know the noise. They used to pass here.
#[test]
fn a_measurement_without_a_variance_says_nothing() {
    for place in [0, 4, 8] {
        let mut covariance = IDENTITY;
        covariance[place] = 0.0;
        let mut seen = sighting();
        seen.covariance = covariance;
        assert_eq!(seen.validate(&LIMITS), Err(Reject::NoCovariance));
        let mut said = pose();
        said.covariance = covariance;
        assert_eq!(said.validate(&LIMITS), Err(Reject::NoCovariance));
        let mut near = neighbour();
        (near.independent, near.dependent) = ([0.0; 9], covariance);
        assert_eq!(near.validate(&LIMITS), Err(Reject::NoCovariance));
    }
    for covariance in [[0.0; 4], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]] {
        let place = Position {
            covariance,
            ..fix()
        };
        assert_eq!(place.validate(&LIMITS), Err(Reject::NoCovariance));
    }
}

/// The wheels' noise may be left to the configuration, and that the robot does not move sideways is certain.
#[test]
fn odometry_may_leave_its_noise_to_the_configuration_but_not_a_part_of_it() {
    let of = |variances: [f64; 3]| {
        let mut wheels = odometry();
        for (place, variance) in [0, 4, 8].into_iter().zip(variances) {
            wheels.covariance[place] = variance;
        }
        (wheels.validate(&LIMITS), wheels.has_configured_noise())
    };
    assert_eq!(of([0.0; 3]), (Ok(()), true));
    assert_eq!(of([0.1, 0.0, 0.1]), (Ok(()), false));
    assert_eq!(of([0.0, 0.1, 0.1]).0, Err(Reject::NoCovariance));
    assert_eq!(of([0.1, 0.0, 0.0]).0, Err(Reject::NoCovariance));
}

/// Beyond 2⁵³ a double no longer tells one count from the next.
#[test]
fn counts_are_whole_numbers_that_can_be_told_apart() {
    let of = |left: f64| {
        let wheels = Odometry {
            kind: OdometryKind::WheelCounts as u8,
            values: [left, 7.0, 0.0, 0.0],
            ..odometry()
        };
        wheels.validate(&LIMITS)
    };
    let most = 9_007_199_254_740_991.0;
    for whole in [0.0, -3.0, most, -most] {
        assert_eq!(of(whole), Ok(()));
    }
    for other in [0.5, -1e-9, most + 1.0, -most - 1.0] {
        assert_eq!(of(other), Err(Reject::Unsupported));
    }
}

#[test]
fn an_estimate_says_what_it_knows() {
    for state in [0, 1, 2, 3].map(BeliefState::from_byte) {
        let said = Estimate {
            state: state as u8,
            fit: 1,
            ..estimate()
        };
        assert_eq!((said.state(), said.is_fit()), (state, true));
    }
    assert!(!estimate().is_fit());
}

#[test]
fn an_estimate_that_is_not_fit_says_why_and_by_how_much() {
    let said = |fit, unfit, fit_limit| {
        let said = Estimate {
            state: BeliefState::Ok as u8,
            fit,
            unfit,
            fit_limit,
            independent: [1.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.25],
            dependent: [0.0; 9],
            ..estimate()
        };
        said.why_unfit().map(|why| why.to_string())
    };
    assert_eq!(said(1, 0, 0.0), None);
    let position = said(0, 2, 0.5);
    assert_eq!(position.as_deref(), Some("position 2.00 m > 0.50 m"));
    let heading = said(0, 3, 0.25);
    assert_eq!(heading.as_deref(), Some("heading 28.6° > 14.3°"));
    for unknown in [0, 1, 99] {
        assert_eq!(said(0, unknown, 0.0).as_deref(), Some("belief ok"));
    }
    let status = |fit, unfit| {
        let status = Status {
            fit,
            unfit,
            ..Status::default()
        };
        status.unfit()
    };
    assert_eq!(status(1, 2), None);
    assert_eq!(status(0, 2), Some(Unfit::Position));
    assert_eq!(status(0, 0), Some(Unfit::Belief));
}

#[test]
fn what_does_not_vary_does_not_covary() {
    let mut own = estimate();
    own.independent[0] = 0.0;
    assert_eq!(own.validate(&LIMITS), Ok(()));
    (own.independent[1], own.independent[3]) = (1e-6, 1e-6);
    assert_eq!(own.validate(&LIMITS), Err(Reject::NotPositiveSemidefinite));
}

#[test]
fn either_part_may_be_nothing() {
    for parts in [([0.0; 9], IDENTITY), (IDENTITY, [0.0; 9])] {
        let (mut near, mut own) = (neighbour(), estimate());
        (near.independent, near.dependent) = parts;
        (own.independent, own.dependent) = parts;
        assert_eq!(near.validate(&LIMITS), Ok(()));
        assert_eq!(own.validate(&LIMITS), Ok(()));
        assert_eq!(own.total().map(f64::to_bits), IDENTITY.map(f64::to_bits));
    }
}

#[test]
fn robots_must_be_known_and_others() {
    for (robot, expected) in [
        (2, Ok(())),
        (3, Ok(())),
        (1, Err(Reject::UnknownRobot)),
        (4, Err(Reject::UnknownRobot)),
    ] {
        let (mut seen, mut near) = (sighting(), neighbour());
        (seen.observed, near.header.source) = (robot, robot);
        assert_eq!(seen.validate(&LIMITS), expected);
        assert_eq!(near.validate(&LIMITS), expected);
    }
    let (mut own, mut counted) = (estimate(), status());
    (own.header.source, counted.header.source) = (9, 9);
    assert_eq!(own.validate(&LIMITS), Err(Reject::UnknownRobot));
    assert_eq!(counted.validate(&LIMITS), Err(Reject::UnknownRobot));
}

/// What comes of a message of every kind whose header was changed.
fn all_with(limits: &Limits, change: impl Fn(&mut Header)) -> [Result<(), Reject>; 8] {
    let (mut said, mut looking) = (pose(), heading());
    change(&mut said.header);
    change(&mut looking.header);
    let (mut seen, mut place, mut near) = (sighting(), fix(), neighbour());
    let (mut wheels, mut own, mut counted) = (odometry(), estimate(), status());
    change(&mut seen.header);
    change(&mut place.header);
    change(&mut near.header);
    change(&mut wheels.header);
    change(&mut own.header);
    change(&mut counted.header);
    [
        seen.validate(limits),
        said.validate(limits),
        looking.validate(limits),
        place.validate(limits),
        near.validate(limits),
        wheels.validate(limits),
        own.validate(limits),
        counted.validate(limits),
    ]
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
        let found = all_with(&LIMITS, |header| header.stamp_ns = stamp_ns);
        assert_eq!(found, [expected; 8], "{stamp_ns}");
    }
}

#[test]
fn a_clock_of_no_meaning_is_refused() {
    for clock in 3..=u8::MAX {
        let found = all_with(&LIMITS, |header| header.clock = clock);
        assert_eq!(found, [Err(Reject::UnknownClock); 8]);
    }
}

#[test]
fn a_clock_that_cannot_be_asked_is_foreign() {
    for clock in [Clock::Realtime, Clock::Tai] {
        let found = all_with(&LIMITS, |header| header.clock = clock as u8);
        assert_eq!(found, [Err(Reject::ForeignClock); 8]);
        let limits = Limits {
            now: Present::only(clock, NOW_NS),
            ..LIMITS
        };
        let found = all_with(&limits, |header| {
            (header.clock, header.boot) = (clock as u8, 0);
        });
        assert_eq!(found, [Ok(()); 8], "of any boot");
    }
}

#[test]
fn the_clock_of_another_boot_is_foreign_and_so_is_that_of_an_unknown_one() {
    for (sent, own) in [(BOOT + 1, BOOT), (0, BOOT), (BOOT, 0), (0, 0)] {
        let limits = Limits {
            boot: own,
            ..LIMITS
        };
        let found = all_with(&limits, |header| header.boot = sent);
        assert_eq!(found, [Err(Reject::ForeignClock); 8], "{sent} {own}");
    }
}

#[test]
fn limits_at_the_ends_of_time_do_not_overflow() {
    for now_ns in [i64::MIN, i64::MAX] {
        let limits = Limits {
            now: Present::only(Clock::Boottime, now_ns),
            history_ns: i64::MAX,
            future_tolerance_ns: i64::MAX,
            ..LIMITS
        };
        let found = all_with(&limits, |header| header.stamp_ns = now_ns);
        assert_eq!(found, [Ok(()); 8]);
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

/// Nothing that is asked for is silently left out.
#[test]
fn what_is_not_supported_yet_is_refused() {
    for components in (0..=u8::MAX).filter(|&it| it != Position::BOTH) {
        let place = Position {
            components,
            ..fix()
        };
        assert_eq!(place.validate(&LIMITS), Err(Reject::Unsupported));
    }
    for components in (0..=u8::MAX).filter(|&it| it != RelativePose::ALL) {
        let seen = RelativePose {
            components,
            ..sighting()
        };
        assert_eq!(seen.validate(&LIMITS), Err(Reject::Unsupported));
    }
    for set in 2..=u8::MAX {
        assert_eq!(
            Pose { set, ..pose() }.validate(&LIMITS),
            Err(Reject::Unsupported)
        );
    }
    for place in 0..7 {
        let mut said = pose();
        said.reserved[place] = 1;
        assert_eq!(said.validate(&LIMITS), Err(Reject::Unsupported));
    }
    for lever_m in [[1000.1, 0.0], [0.0, -1e9]] {
        let place = Position { lever_m, ..fix() };
        assert_eq!(place.validate(&LIMITS), Err(Reject::Unsupported));
    }
    for what in 3..=u8::MAX {
        let looking = Heading { what, ..heading() };
        assert_eq!(looking.validate(&LIMITS), Err(Reject::Unsupported));
    }
    for place in 0..6 {
        let mut looking = heading();
        looking.reserved[place] = 1;
        assert_eq!(looking.validate(&LIMITS), Err(Reject::Unsupported));
    }
    for (kind, unused) in [(0, 3), (1, 2), (1, 3), (2, 2), (2, 3)] {
        let mut wheels = odometry();
        (wheels.kind, wheels.values) = (kind, [0.0; 4]);
        assert_eq!(wheels.validate(&LIMITS), Ok(()));
        wheels.values[unused] = 1.0;
        assert_eq!(wheels.validate(&LIMITS), Err(Reject::Unsupported));
    }
    for kind in 3..=u8::MAX {
        let wheels = Odometry { kind, ..odometry() };
        assert_eq!(wheels.validate(&LIMITS), Err(Reject::Unsupported));
    }
}

#[test]
fn a_slow_error_is_known_or_unknown_and_never_less() {
    let of = |slow_sigma_m, slow_time_s| {
        let place = Position {
            slow_sigma_m,
            slow_time_s,
            ..fix()
        };
        place.validate(&LIMITS)
    };
    assert_eq!(of(1.5, 300.0), Ok(()));
    for bad in [f64::NAN, f64::INFINITY] {
        assert_eq!(of(bad, 0.0), Err(Reject::NotFinite));
        assert_eq!(of(0.0, bad), Err(Reject::NotFinite));
    }
    assert_eq!(of(-1.0, 300.0), Err(Reject::NotPositiveSemidefinite));
    assert_eq!(of(1.0, -300.0), Err(Reject::NotPositiveSemidefinite));
}

#[test]
fn an_interval_ends_after_it_begins() {
    for (start_ns, expected) in [
        (0, Ok(())),
        (NOW_NS - 1, Ok(())),
        (NOW_NS, Err(Reject::EmptyInterval)),
        (i64::MAX, Err(Reject::EmptyInterval)),
    ] {
        let wheels = Odometry {
            start_ns,
            ..odometry()
        };
        assert_eq!(wheels.validate(&LIMITS), expected, "{start_ns}");
    }
}

/// One message with every fault; they are mended one by one, and each mending shows the next reason.
#[test]
fn of_several_reasons_the_first_is_named() {
    let mut message = Neighbour {
        pose: [f64::NAN, 0.0, 0.0],
        independent: ASYMMETRIC,
        dependent: INDEFINITE,
        header: Header {
            source: 9,
            clock: 9,
            boot: 0,
            ..at(i64::MAX)
        },
    };
    let mut next = |reason: Reject, mend: fn(&mut Neighbour)| {
        assert_eq!(message.validate(&LIMITS), Err(reason));
        mend(&mut message);
    };
    next(Reject::NotFinite, |message| message.pose[0] = 0.0);
    next(Reject::Asymmetric, |message| {
        message.independent = INDEFINITE;
    });
    next(Reject::NotPositiveSemidefinite, |message| {
        message.independent = [0.0; 9];
    });
    next(Reject::DependentNotPositiveSemidefinite, |message| {
        message.dependent = [0.0; 9];
    });
    next(Reject::NoCovariance, |message| message.dependent = HALF);
    next(Reject::UnknownRobot, |message| message.header.source = 2);
    next(Reject::UnknownClock, |message| message.header.clock = 0);
    next(Reject::ForeignClock, |message| message.header.boot = BOOT);
    next(Reject::FromFuture, |message| message.header.stamp_ns = 0);
    next(Reject::TooOld, |message| message.header.stamp_ns = NOW_NS);
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

fn in_parts(independent: Matrix, dependent: Matrix) -> Result<(), Reject> {
    Neighbour {
        independent: flat(independent),
        dependent: flat(dependent),
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
    fn covariances_of_every_rank_and_unit_pass(a in entries(), rank in 1_usize..=3, units in units()) {
        let singular = covariance(a, rank, units);
        prop_assume!((0..3).all(|i| singular[i][i] > 0.0));
        prop_assert_eq!(sighting_with(singular), Ok(()));
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

    /// Rounding of a difference is no fault of the sender's: the parts may come from any subtraction.
    #[test]
    fn any_share_of_the_total_may_be_independent(a in entries(), units in units(), share in 0.0..=1.0) {
        let total = covariance(a, 3, units);
        prop_assume!((0..3).all(|i| total[i][i] > 0.0));
        let independent = from_fn(|i, j| share * total[i][j]);
        let dependent = from_fn(|i, j| total[i][j] - independent[i][j]);
        prop_assert_eq!(in_parts(independent, dependent), Ok(()));
    }

    #[test]
    fn less_than_nothing_is_found_in_every_unit(a in entries(), units in units(), share in 1.00001..10.0) {
        let total = covariance(a, 3, units);
        prop_assume!((0..3).all(|i| total[i][i] > 0.0));
        let independent = from_fn(|i, j| share * total[i][j]);
        let dependent = from_fn(|i, j| total[i][j] - independent[i][j]);
        prop_assert_eq!(in_parts(independent, dependent), Err(Reject::DependentNotPositiveSemidefinite));
    }

    /// Whatever the bytes are, there is an answer; and what passes is finite.
    #[test]
    fn no_bytes_can_do_harm(
        numbers in prop::array::uniform21(any::<u64>().prop_map(f64::from_bits)),
        stamp_ns in any::<i64>(), source in any::<u16>(), clock in any::<u8>(), boot in any::<u64>(),
    ) {
        let header = Header { stamp_ns, boot, source, clock, ..Header::default() };
        let mut message = Neighbour { header, ..Neighbour::default() };
        message.pose.copy_from_slice(&numbers[..3]);
        message.independent.copy_from_slice(&numbers[3..12]);
        message.dependent.copy_from_slice(&numbers[12..]);
        if message.validate(&LIMITS).is_ok() {
            prop_assert!(numbers.iter().all(|number| number.is_finite()));
        }
    }
}
