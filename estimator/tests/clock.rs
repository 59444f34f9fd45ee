//! Gaps in the odometry, stamps from the future, clocks that jump, storage that runs full.
#![allow(clippy::unwrap_used)] // A test may panic.

use coloc_estimator::noise::Variance;
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimate, Estimator, Kind, Measurement, Motion,
    NeighbourPose, OdometryNoise, OdometrySample, OdometryState, Origin, Parts, Pose, PositionFix,
    Report, RobotId, Settings, Sighting, Slot, SlowError, Source, Span, Stamp, TickInputs,
    TickOutputs, Verdict, step,
};

type Robot = Estimator<Vec<Slot>>;

fn ms(millis: i64) -> Stamp {
    Stamp::default() + Span::from_millis(millis)
}

fn robot_with(slots: usize) -> Robot {
    let initial = Belief::independent(
        Pose::default(),
        Covariance3::diagonal([1e-4, 1e-4, 1e-6]).unwrap(),
    );
    Estimator::new(
        Settings::default(),
        ms(0),
        initial,
        vec![Slot::default(); slots],
    )
}

fn robot() -> Robot {
    robot_with(256)
}

/// 1 m/s straight ahead.
fn ahead(start: i64, stamp: i64) -> OdometrySample {
    let noise = Covariance2::diagonal([0.01, 0.001]).unwrap();
    let motion = Motion::Nonholonomic {
        velocity: [1.0, 0.0],
        noise,
    };
    OdometrySample {
        source: 0,
        start: ms(start),
        stamp: ms(stamp),
        motion,
    }
}

fn fix(stamp: i64, x: f64) -> PositionFix {
    let covariance = Covariance2::diagonal([0.01, 0.01]).unwrap();
    PositionFix {
        stamp: ms(stamp),
        origin: Origin::default(),
        position: [x, 0.0],
        covariance,
        lever: [0.0; 2],
        slow: SlowError::default(),
    }
}

fn sighting(stamp: i64) -> Sighting {
    let covariance = Covariance3::diagonal([0.01, 0.01, 3e-4]).unwrap();
    Sighting {
        stamp: ms(stamp),
        origin: Origin::default(),
        observed: RobotId(2),
        relative: Pose::new(2.0, 0.0, 0.0),
        covariance,
    }
}

fn tick<'a, T: Copy + Into<Measurement>>(
    robot: &'a mut Robot,
    stamp: Stamp,
    measured: &[T],
) -> TickOutputs<'a> {
    let measurements: Vec<_> = measured.iter().map(|&measured| measured.into()).collect();
    step(
        robot,
        &TickInputs {
            stamp,
            measurements: &measurements,
        },
    )
}

fn drive(robot: &mut Robot, stamp: i64, samples: &[OdometrySample]) -> Estimate {
    tick(robot, ms(stamp), samples).estimate
}

fn locate(robot: &mut Robot, stamp: i64, fixes: &[PositionFix]) -> (Estimate, Vec<Report>) {
    let outputs = tick(robot, ms(stamp), fixes);
    (outputs.estimate, outputs.reports.to_vec())
}

fn idle(robot: &mut Robot, stamp: i64) -> Estimate {
    drive(robot, stamp, &[])
}

fn x_variance(estimate: &Estimate) -> f64 {
    estimate.belief.total().matrix()[(0, 0)]
}

fn assert_near(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() < 1e-3,
        "{found} instead of {expected}"
    );
}

#[test]
fn a_velocity_is_held_for_the_hold_time_and_then_taken_as_zero() {
    let mut robot = robot();
    let fresh = drive(&mut robot, 20, &[ahead(0, 20)]);
    assert_eq!(
        (fresh.odometry, fresh.velocity),
        (OdometryState::Fresh, [1.0, 0.0, 0.0])
    );
    let held = idle(&mut robot, 220); // 200 ms is the default hold time.
    assert_eq!(
        (held.odometry, held.velocity),
        (OdometryState::Held, [1.0, 0.0, 0.0])
    );
    assert_near(held.belief.pose.x, 0.22);
    let stale = idle(&mut robot, 520);
    assert_eq!(
        (stale.odometry, stale.velocity),
        (OdometryState::Stale, [0.0; 3])
    );
    assert_near(stale.belief.pose.x, 0.22);
}

#[test]
fn uncertainty_grows_while_held_and_faster_without_odometry() {
    let mut robot = robot();
    let fresh = drive(&mut robot, 20, &[ahead(0, 20)]);
    let held = [120, 220].map(|stamp| x_variance(&idle(&mut robot, stamp)));
    let stale = x_variance(&idle(&mut robot, 320));
    let growth = [
        held[0] - x_variance(&fresh),
        held[1] - held[0],
        stale - held[1],
    ];
    assert!(
        0.0 < growth[0] && growth[0] < growth[1] && growth[1] < growth[2],
        "{growth:?}"
    );
}

#[test]
fn without_any_odometry_the_robot_stands_and_doubts() {
    let mut robot = robot();
    let estimate = idle(&mut robot, 1000);
    assert_eq!(
        (estimate.odometry, estimate.velocity),
        (OdometryState::Stale, [0.0; 3])
    );
    assert!(x_variance(&estimate) > 0.05);
}

#[test]
fn a_sample_that_comes_late_replaces_what_was_held() {
    let (mut punctual, mut late) = (robot(), robot());
    let (_, reports) = locate(&mut late, 100, &[fix(60, 0.05)]);
    assert!(matches!(
        reports[..],
        [Report {
            source: Source {
                kind: Kind::Fix,
                ..
            },
            verdict: Verdict::Accepted { .. },
            ..
        }]
    ));
    drive(&mut late, 300, &[ahead(0, 120)]);
    drive(&mut punctual, 120, &[ahead(0, 120)]);
    locate(&mut punctual, 300, &[fix(60, 0.05)]);
    assert_eq!(punctual.belief_at(ms(300)), late.belief_at(ms(300)));
}

#[test]
fn a_measurement_ahead_of_the_tick_waits_for_it() {
    let mut robot = robot();
    let (before, reports) = locate(&mut robot, 20, &[fix(50, 0.01)]);
    assert_eq!((before.belief.pose.x, reports), (0.0, vec![]));
    let (after, reports) = locate(&mut robot, 60, &[]);
    assert!(after.belief.pose.x > 0.0);
    assert_eq!(reports.len(), 1);
    assert_eq!(locate(&mut robot, 80, &[]).1, []);
}

#[test]
fn the_tolerance_and_the_history_reach_to_their_last_nanosecond() {
    let settings = Settings::default();
    let (now, instant) = (ms(5000), Span::from_nanos(1));
    for (stamp, refused) in [
        (now + settings.future_tolerance, None),
        (
            now + settings.future_tolerance + instant,
            Some(Verdict::FromFuture),
        ),
        (now - settings.history, None),
        (now - settings.history - instant, Some(Verdict::TooOld)),
    ] {
        let mut robot = robot();
        let at = PositionFix {
            stamp,
            ..fix(0, 0.0)
        };
        let reports = tick(&mut robot, now, &[at]).reports.to_vec();
        let verdict = reports.first().map(|report| report.verdict);
        let passed = matches!(verdict, None | Some(Verdict::Accepted { .. }));
        assert_eq!(verdict.filter(|_| !passed), refused, "{stamp:?}");
        let later = tick::<Measurement>(&mut robot, now + settings.future_tolerance, &[]);
        assert_eq!(later.reports.len(), usize::from(stamp > now && passed));
    }
}

#[test]
fn a_sighting_is_told_once_whatever_is_replayed() {
    let mut robot = robot();
    let told = tick(&mut robot, ms(40), &[sighting(30)]).outgoing.to_vec();
    assert_eq!(
        told.iter()
            .map(|pose| (pose.to, pose.stamp))
            .collect::<Vec<_>>(),
        [(RobotId(2), ms(30))]
    );
    assert_near(told[0].pose.x, 2.0);
    let late = tick(&mut robot, ms(60), &[ahead(0, 30)]);
    assert!(late.outgoing.is_empty());
}

#[test]
fn a_clock_that_steps_back_within_the_history_is_answered_from_it() {
    let mut robot = robot();
    let then = drive(&mut robot, 40, &[ahead(0, 20), ahead(20, 40)]);
    drive(&mut robot, 60, &[ahead(40, 60)]);
    assert_eq!(idle(&mut robot, 40), then);
}

#[test]
fn a_clock_that_steps_back_before_the_history_gets_its_beginning_and_no_nan() {
    let mut robot = robot();
    for k in 1..=100 {
        drive(&mut robot, 20 * k, &[ahead(20 * (k - 1), 20 * k)]);
    }
    let (estimate, reports) = locate(&mut robot, -3_600_000, &[fix(-3_600_000, 0.0)]);
    assert_near(estimate.belief.pose.x, 0.98); // 1 s of history behind 2 s.
    assert_eq!(estimate.odometry, OdometryState::Stale);
    assert_eq!(
        reports
            .iter()
            .map(|report| report.verdict)
            .collect::<Vec<_>>(),
        [Verdict::TooOld]
    );
    assert_near(idle(&mut robot, 2000).belief.pose.x, 2.0);
}

#[test]
fn a_single_tick_far_ahead_does_no_lasting_harm() {
    let (mut steady, mut jumped) = (robot(), robot());
    for robot in [&mut steady, &mut jumped] {
        drive(robot, 20, &[ahead(0, 20)]);
    }
    let far = idle(&mut jumped, 3_600_000);
    assert!(x_variance(&far) > 100.0 && x_variance(&far).is_finite());
    assert_eq!(
        drive(&mut jumped, 40, &[ahead(20, 40)]),
        drive(&mut steady, 40, &[ahead(20, 40)])
    );
}

#[test]
fn the_ends_of_the_clock_are_survived() {
    let mut robot = robot();
    for nanos in [i64::MAX, i64::MIN, 0, i64::MAX] {
        let stamp = Stamp::from_nanos(nanos);
        let whole = OdometrySample {
            start: Stamp::from_nanos(i64::MIN),
            stamp,
            ..ahead(0, 1)
        };
        let inputs: [Measurement; 2] = [whole.into(), fix(0, 0.0).into()];
        let outputs = tick(&mut robot, stamp, &inputs);
        assert!(outputs.estimate.belief.pose.is_finite());
    }
}

#[test]
fn beliefs_are_known_from_the_history_s_beginning_to_the_tick() {
    let mut robot = robot();
    idle(&mut robot, 100);
    assert!(robot.belief_at(ms(0)).is_some() && robot.belief_at(ms(100)).is_some());
    assert_eq!(robot.belief_at(ms(101)), None);
    assert_eq!(robot.belief_at(ms(-1)), None);
}

#[test]
fn full_storage_gives_up_its_oldest_for_what_is_newer() {
    let (mut small, mut large) = (robot_with(8), robot());
    let samples: Vec<_> = (0..20).map(|k| ahead(20 * k, 20 * (k + 1))).collect();
    let outputs = tick(&mut small, ms(400), &samples);
    assert_eq!((outputs.folded_early, outputs.reports), (12, &[][..]));
    assert_eq!(outputs.estimate, drive(&mut large, 400, &samples));
    let (_, reports) = locate(&mut small, 400, &[fix(240, 0.2)]);
    assert_eq!(reports[0].verdict, Verdict::TooOld);
}

#[test]
fn what_is_given_up_early_has_been_driven_by_odometry_that_came_with_it() {
    let (mut small, mut large) = (robot_with(4), robot());
    let fixes = (0..6).map(|k| PositionFix {
        origin: Origin::counted(k),
        ..fix(110 + 10 * i64::try_from(k).unwrap(), 0.15)
    });
    let mut measured: Vec<Measurement> = fixes.map(Into::into).collect();
    measured.push(ahead(0, 200).into());
    let outputs = tick(&mut small, ms(200), &measured);
    assert_eq!(outputs.folded_early, 3);
    assert_eq!(
        outputs.estimate,
        tick(&mut large, ms(200), &measured).estimate
    );
}

#[test]
fn full_storage_refuses_what_is_older_than_all_in_it() {
    let mut robot = robot_with(4);
    let samples: Vec<_> = (5..9).map(|k| ahead(20 * k, 20 * (k + 1))).collect();
    drive(&mut robot, 200, &samples);
    let before = robot.belief_at(ms(200));
    let (_, reports) = locate(&mut robot, 200, &[fix(90, 0.0)]);
    assert_eq!(reports[0].verdict, Verdict::NoRoom);
    assert_eq!(robot.belief_at(ms(200)), before);
}

#[test]
fn full_storage_does_not_give_up_what_waits_for_its_tick() {
    let mut robot = robot_with(4);
    let early: Vec<_> = (1..5).map(|k| fix(20 + 10 * k, 0.0)).collect();
    assert_eq!(locate(&mut robot, 20, &early).1, []);
    let (_, reports) = locate(&mut robot, 20, &[fix(70, 0.0)]);
    assert_eq!(
        reports[0].verdict,
        Verdict::NoRoom,
        "all that is there is still to come"
    );
    let (_, reports) = locate(&mut robot, 60, &[]);
    assert_eq!(reports.len(), 4, "and comes");
}

#[test]
fn what_does_not_fit_into_the_lists_is_counted() {
    let mut robot = robot_with(512);
    let sightings: Vec<_> = (0..200)
        .map(|sequence| Sighting {
            origin: Origin::counted(sequence),
            ..sighting(10)
        })
        .collect();
    let outputs = tick(&mut robot, ms(20), &sightings);
    assert_eq!((outputs.outgoing.len(), outputs.overflowed), (128, 72));
}

/// The measurement, what is to be said of it.
fn verdict_of(measurement: impl Into<Measurement>) -> Option<Verdict> {
    let mut robot = robot();
    let before = idle(&mut robot, 20);
    let outputs = tick(&mut robot, ms(20), &[measurement.into()]);
    let verdict = outputs.reports.first().map(|report| report.verdict);
    if !matches!(verdict, Some(Verdict::Accepted { .. }) | None) {
        assert_eq!(outputs.estimate, before, "what is refused changes nothing");
    }
    verdict
}

#[test]
fn a_variance_of_zero_is_no_measurement() {
    let line = Covariance2::from_row_major([0.01, 0.01, 0.01, 0.01]).unwrap();
    assert!(matches!(
        verdict_of(fix(20, 0.0)),
        Some(Verdict::Accepted { .. })
    ));
    let along = PositionFix {
        covariance: line,
        slow: SlowError::default(),
        ..fix(20, 0.0)
    };
    assert!(
        matches!(verdict_of(along), Some(Verdict::Accepted { .. })),
        "singular is legal"
    );
    for covariance in [
        Covariance2::ZERO,
        Covariance2::diagonal([0.01, 0.0]).unwrap(),
    ] {
        let fix = PositionFix {
            covariance,
            slow: SlowError::default(),
            ..fix(20, 0.0)
        };
        assert_eq!(verdict_of(fix), Some(Verdict::NoNoise));
    }
    for covariance in [
        Covariance3::ZERO,
        Covariance3::diagonal([0.01, 0.01, 0.0]).unwrap(),
    ] {
        let seen = Sighting {
            covariance,
            ..sighting(20)
        };
        assert_eq!(verdict_of(seen), Some(Verdict::NoNoise));
        assert_eq!(verdict_of(heard(covariance)), Some(Verdict::NoNoise));
    }
}

fn heard(total: Covariance3) -> NeighbourPose {
    NeighbourPose {
        stamp: ms(20),
        origin: Origin {
            source: 3,
            ..Origin::default()
        },
        pose: Pose::default(),
        parts: Parts::dependent(total),
    }
}

#[test]
fn what_is_no_number_or_nowhere_is_refused() {
    for odd in [f64::NAN, f64::INFINITY, -1e13] {
        let somewhere = Pose {
            x: odd,
            ..Pose::default()
        };
        let noise = Covariance3::diagonal([0.01; 3]).unwrap();
        let motion = Motion::Holonomic {
            velocity: [0.0, odd, 0.0],
            noise,
        };
        let refused: [Measurement; 4] = [
            PositionFix {
                position: [0.0, odd],
                ..fix(20, 0.0)
            }
            .into(),
            Sighting {
                relative: somewhere,
                ..sighting(20)
            }
            .into(),
            NeighbourPose {
                pose: somewhere,
                ..heard(noise)
            }
            .into(),
            OdometrySample {
                motion,
                ..ahead(0, 20)
            }
            .into(),
        ];
        for measurement in refused {
            assert_eq!(
                verdict_of(measurement),
                Some(Verdict::NotFinite),
                "{measurement:?}"
            );
        }
    }
}

/// Two receivers with equal stamps and counts, one session each: two fixes, whoever is heard first.
#[test]
fn two_receivers_are_two_whatever_they_count() {
    let of = |source, session| PositionFix {
        origin: Origin {
            source,
            session,
            sequence: 7,
        },
        ..fix(20, 0.1 * f64::from(source))
    };
    let beliefs = [[of(0, 9), of(1, 2)], [of(1, 9), of(0, 2)]].map(|fixes| {
        let mut robot = robot();
        let outputs = tick(&mut robot, ms(20), &fixes);
        let sources = outputs.reports.iter().map(|report| report.source.number);
        assert_eq!(
            sources.collect::<Vec<_>>(),
            [0, 1],
            "sources come before sessions"
        );
        outputs.estimate.belief
    });
    assert_eq!(beliefs[0], beliefs[1]);
}

#[test]
fn no_source_is_more_certain_than_its_floor() {
    let mut settings = Settings::default();
    settings.floors.fix = [0.04; 2];
    settings.floors.neighbour = [0.04, 0.04, 0.01];
    let believing = |covariance: f64, settings: Settings| {
        let initial =
            Belief::independent(Pose::default(), Covariance3::diagonal([1.0; 3]).unwrap());
        let mut robot = Estimator::new(settings, ms(0), initial, vec![Slot::default(); 8]);
        let diagonal = Covariance2::diagonal([covariance; 2]).unwrap();
        let fix = PositionFix {
            covariance: diagonal,
            slow: SlowError::default(),
            ..fix(20, 0.0)
        };
        let total = Covariance3::diagonal([covariance, covariance, 0.25 * covariance]).unwrap();
        tick::<Measurement>(&mut robot, ms(20), &[heard(total).into(), fix.into()]).estimate
    };
    assert_eq!(
        believing(0.0001, settings),
        believing(0.04, Settings::default())
    );
    assert_eq!(
        believing(0.05, settings),
        believing(0.05, Settings::default())
    );
}

#[test]
fn nobody_is_told_of_a_sighting_that_is_more_certain_than_its_floor() {
    let mut settings = Settings::default();
    settings.floors.sighting = [0.04, 0.04, 0.01];
    let told = |variances: [f64; 3], settings: Settings| {
        let initial = Belief::independent(Pose::default(), Covariance3::ZERO);
        let mut robot = Estimator::new(settings, ms(0), initial, vec![Slot::default(); 8]);
        let sighting = Sighting {
            covariance: Covariance3::diagonal(variances).unwrap(),
            ..sighting(20)
        };
        tick(&mut robot, ms(20), &[sighting]).outgoing.to_vec()
    };
    let [low, high] = [[1e-4, 1e-4, 1e-6], [0.04, 0.04, 0.01]];
    let plain = Settings::default();
    assert_eq!(told(low, settings), told(high, plain));
    assert_ne!(told(low, plain), told(high, plain));
}

#[test]
fn noise_beyond_all_numbers_is_not_taken_for_none() {
    let wild = Variance {
        a: 1e308,
        b: 1e308,
        c: 1e308,
        per_speed: 1e308,
        per_turn_rate: 1e308,
    };
    let noise = OdometryNoise {
        forward: wild,
        sideways: wild,
        turning: wild,
    };
    for motion in [
        noise.nonholonomic([1.0, 2.0]),
        noise.holonomic([1.0, 1.0, 2.0]),
    ] {
        let mut robot = robot();
        let sample = OdometrySample {
            motion,
            ..ahead(0, 20)
        };
        let driven = drive(&mut robot, 20, &[sample]);
        assert!(is_lost(&driven), "{driven:?}");
        assert!(is_lost(&idle(&mut robot, 100)), "held");
        let (located, _) = locate(&mut robot, 120, &[fix(120, 0.0)]);
        assert!(
            x_variance(&located) > 0.0099,
            "no more certain than the fix"
        );
    }
    let mut settings = Settings::default();
    settings.odometry.outage_variance = [1e308, f64::INFINITY, f64::NAN];
    settings.odometry.hold_growth = 1e308;
    let initial = Belief::independent(Pose::default(), Covariance3::ZERO);
    let mut robot = Estimator::new(settings, ms(0), initial, vec![Slot::default(); 8]);
    assert!(is_lost(&idle(&mut robot, 20)), "an outage");
    drive(&mut robot, 40, &[ahead(20, 40)]);
    assert!(
        is_lost(&idle(&mut robot, 60)),
        "held with a growth beyond all numbers"
    );
}

/// Finite, and as uncertain as can be, ahead and about where ahead is.
fn is_lost(estimate: &Estimate) -> bool {
    let (total, pose) = (estimate.belief.total(), estimate.belief.pose);
    let p = total.matrix();
    let [along, _, heading] = total.variances();
    pose.is_finite() && p.iter().all(|entry| entry.is_finite()) && along.min(heading) > 1e20
}
