//! The estimator that flies as a member of a team: what it does in rounds.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use coloc_estimator::rounds::{Correction, Refusal, RoundSettings, Shared, Standing, gate};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Deed, Estimator, Kind, Measurement, Motion, NeighbourPose,
    OdometrySample, Origin, Parts, Pose, PoseSaid, PositionFix, RoundWord, Settings, Slot,
    SlowError, Span, Stamp, TickInputs, Verdict, step,
};
use coloc_rounds::Member;
use coloc_rounds::member::Settings as MemberSettings;
use nalgebra::Matrix3;

const TICK_MS: i64 = 20;
/// A slot is ten ticks.
const EVERY: i64 = 10;

fn at(tick: i64) -> Stamp {
    Stamp::from_nanos(1_000_000 * TICK_MS * tick)
}

fn settings() -> Settings {
    Settings {
        rounds: Some(RoundSettings {
            robots: 5,
            gate: gate::CHI2_3_ONE_IN_A_MILLION,
        }),
        ..Settings::default()
    }
}

fn initial() -> Belief {
    let covariance = Covariance3::diagonal([0.01, 0.01, 1e-6]).unwrap();
    Belief::independent(Pose::new(1.0, 2.0, 0.3), covariance)
}

type Robot = Estimator<Vec<Slot>>;

fn robot(settings: &Settings) -> Robot {
    Estimator::new(*settings, at(0), initial(), vec![Slot::default(); 512])
}

/// Straight on, and turning on the spot: there the arc is the step. The noise is the same in all directions.
fn motion(tick: i64) -> Motion {
    let velocity = if tick % 7 == 0 {
        [0.0, 0.0, 0.8]
    } else {
        [0.9, 0.0, 0.0]
    };
    Motion::Holonomic {
        velocity,
        noise: Covariance3::diagonal([0.002, 0.002, 1e-6]).unwrap(),
    }
}

fn drive(tick: i64) -> Measurement {
    Measurement::Odometry(OdometrySample {
        source: 0,
        start: at(tick - 1),
        stamp: at(tick),
        motion: motion(tick),
    })
}

fn noise() -> Covariance2 {
    Covariance2::diagonal([0.01, 0.02]).unwrap()
}

fn position(tick: i64) -> Option<[f64; 2]> {
    #[allow(clippy::cast_precision_loss)] // A few.
    let offset = 0.01 * (tick % 13) as f64;
    (tick % 5 == 3).then_some([1.0 + 0.6 * offset, 2.0 + offset])
}

fn fix(tick: i64, position: [f64; 2]) -> Measurement {
    Measurement::Fix(PositionFix {
        stamp: at(tick),
        origin: Origin::counted(tick.cast_unsigned()),
        position,
        covariance: noise(),
        lever: [0.0; 2],
        slow: SlowError::default(),
    })
}

fn word(tick: i64, sequence: u64, deed: Deed) -> Measurement {
    Measurement::Round(RoundWord {
        stamp: at(tick),
        origin: Origin::counted(sequence),
        deed,
        of: None,
    })
}

fn correct(tick: i64, told: &Correction) -> Measurement {
    let deed = Deed::Correct {
        slot: told.slot,
        pose: told.pose,
        covariance: Covariance3::new(told.covariance).unwrap(),
        factor: told.factor,
    };
    word(tick, 1000 + told.slot, deed)
}

/// What an honest leader might make of it: half of the variances are left, and the pose is a little off.
fn corrected(shared: &Shared) -> Correction {
    let sigma = shared.covariance.diagonal().map(f64::sqrt);
    let Pose { x, y, phi } = shared.pose;
    Correction {
        slot: shared.slot,
        pose: Pose::new(x + 0.5 * sigma[0], y - 0.3 * sigma[1], phi + 0.4 * sigma[2]),
        covariance: 0.5 * shared.covariance,
        factor: 1.0,
    }
}

/// A tick, with what it says of rounds.
fn tick(robot: &mut Robot, tick: i64, more: &[Measurement]) -> Vec<Verdict> {
    let mut measurements = vec![drive(tick)];
    let has_fixes = !robot.settings().found.enabled;
    measurements.extend(position(tick).filter(|_| has_fixes).map(|it| fix(tick, it)));
    measurements.extend_from_slice(more);
    let outputs = step(
        robot,
        &TickInputs {
            stamp: at(tick),
            measurements: &measurements,
        },
    );
    let of_rounds = outputs
        .reports
        .iter()
        .filter(|it| it.source.kind == Kind::Round);
    of_rounds.map(|it| it.verdict).collect()
}

fn believed(robot: &Robot, tick: i64) -> Belief {
    robot.belief_at(at(tick)).unwrap()
}

/// The fixes are far from where these motions lead, and are believed all the same.
fn wide_gates() -> Settings {
    let mut settings = settings();
    settings.position_gate = f64::INFINITY;
    settings.found.enabled = false;
    settings
}

fn joined(settings: &Settings) -> Robot {
    let mut robot = robot(settings);
    assert_eq!(
        tick(&mut robot, 1, &[word(1, 1, Deed::Join)]),
        [Verdict::Heard]
    );
    robot
}

/// Runs on, corrected `late` ticks after each slot.
fn run(robot: &mut Robot, ticks: core::ops::Range<i64>, late: i64) -> Vec<Shared> {
    let mut shares = Vec::new();
    let mut waiting: Vec<(i64, Correction)> = Vec::new();
    for now in ticks {
        let due = waiting.iter().filter(|(at, _)| *at == now);
        let due: Vec<_> = due.map(|(_, told)| correct(now, told)).collect();
        let verdicts = tick(robot, now, &due);
        assert!(
            verdicts.iter().all(|it| *it == Verdict::Heard),
            "{verdicts:?}"
        );
        if now % EVERY == 0 {
            let shared = robot.share((now / EVERY).cast_unsigned(), at(now)).unwrap();
            waiting.push((now + late, corrected(&shared)));
            shares.push(shared);
        }
    }
    shares
}

/// By how much the covariance of position and heading of an arc is more than that of a straight step, since the last round: the error of a
/// turn is half in the way of the same step, `½ d q` a tick with the way d and the turn's variance q \[m rad\].
fn of_arcs() -> f64 {
    const TICKS_SINCE: f64 = 14.0;
    let (way, turn) = (0.9 * 0.02, 1e-6 * 0.02 * 0.02);
    TICKS_SINCE * 0.5 * way * turn
}

/// What that makes of the heading: no more than two fixes since the last round, each as far away as the robot is from them \[rad\].
fn turned_by_fixes(from: &Pose) -> f64 {
    let [away_x, away_y] = [from.x - 1.0, from.y - 2.0].map(|it| it.abs() + 0.2);
    2.0 * of_arcs() * (away_x / 0.01 + away_y / 0.02)
}

/// The other one is [`Member`], which knows nothing of arcs, bends and parts. What they differ by is what it does not know of arcs; the robot drives
/// away from its fixes, so each of them is a longer lever for it.
#[test]
fn in_rounds_it_is_the_member_that_the_team_is_tried_with() {
    let mut robot = joined(&wide_gates());
    let member = MemberSettings {
        robots: 5,
        fix_gate: f64::INFINITY,
        correction_gate: gate::CHI2_3_ONE_IN_A_MILLION,
        history: 512,
    };
    let first = believed(&robot, 1);
    let start = (first.pose, first.total().matrix());
    let mut other = Member::new(member, at(1).as_nanos(), start, Standing::Joining(1));
    let mut waiting: Option<(i64, Correction)> = None;
    for now in 2..900 {
        let due = waiting
            .as_ref()
            .filter(|(when, _)| *when == now)
            .map(|it| it.1);
        let told: Vec<_> = due.iter().map(|it| correct(now, it)).collect();
        assert!(
            tick(&mut robot, now, &told)
                .iter()
                .all(|it| *it == Verdict::Heard)
        );
        other.drive(at(now).as_nanos(), motion(now), 0.02);
        if let Some(position) = position(now) {
            other.fix(at(now).as_nanos(), position, noise());
        }
        if let Some(told) = due {
            other.correct(&told).unwrap();
        }
        if now % EVERY == 0 {
            let slot = (now / EVERY).cast_unsigned();
            let shared = [robot.share(slot, at(now)).unwrap(), other.share(slot)];
            let [one, two] = &shared;
            assert_eq!(one.standing, two.standing);
            let off = one.pose.to_vector() - two.pose.to_vector();
            let sigma = two.covariance.diagonal().map(f64::sqrt);
            let turned = turned_by_fixes(&two.pose);
            for i in 0..3 {
                let by_arcs = if i == 2 { turned } else { 0.0 };
                assert!(
                    off[i].abs() < 2e-5 * sigma[i] + by_arcs,
                    "{now}: {off:?}, {turned:e}"
                );
                for j in 0..3 {
                    let by_arcs = if (i == 2) == (j == 2) { 0.0 } else { of_arcs() };
                    let apart = (one.covariance - two.covariance)[(i, j)].abs();
                    assert!(
                        apart < 1e-5 * sigma[i] * sigma[j] + by_arcs,
                        "{now}: P {apart}"
                    );
                    let apart = (one.psi - two.psi)[(i, j)].abs();
                    assert!(
                        apart < 1e-6 * (1.0 + two.psi[(i, j)].abs()),
                        "{now}: Ψ {apart}"
                    );
                }
            }
            waiting = Some((now + 4, corrected(two)));
        }
    }
}

/// The shares are not those of a later slot, so the next correction has to be there before it.
#[test]
fn a_late_correction_gives_the_bits_of_a_prompt_one() {
    let beliefs = [1, 3, 9].map(|late| {
        let mut robot = joined(&wide_gates());
        let shares = run(&mut robot, 2..310, late);
        (shares, believed(&robot, 309))
    });
    assert_eq!(beliefs[0], beliefs[1]);
    assert_eq!(beliefs[0], beliefs[2]);
    assert_eq!(beliefs[0].0[0].standing, Standing::Joining(1));
    assert_eq!(beliefs[0].0[5].standing, Standing::Since(5));
}

#[test]
fn who_may_take_part_and_does_not_has_the_bits_of_who_may_not() {
    let beliefs = [settings(), Settings::default()].map(|settings| {
        let mut robot = robot(&settings);
        let mut beliefs = Vec::new();
        for now in 1..200 {
            assert!(tick(&mut robot, now, &[]).is_empty());
            assert_eq!(robot.share(now.cast_unsigned(), at(now)), None);
            beliefs.push(believed(&robot, now));
        }
        beliefs
    });
    assert_eq!(beliefs[0], beliefs[1]);
}

#[test]
fn who_may_not_refuses_every_word_of_rounds() {
    let mut robot = robot(&Settings::default());
    for deed in [Deed::Join, Deed::Leave, Deed::Undo(None)] {
        let refused = Verdict::NotFollowed(Refusal::TookNoPart);
        assert_eq!(tick(&mut robot, 1, &[word(1, 1, deed)]), [refused]);
    }
}

/// Whatever a leader says: moved by 0.1 to 100 m, too certain, more uncertain, for another slot.
#[test]
fn a_correction_that_no_round_can_make_moves_nothing_and_is_named() {
    let mut honest = joined(&wide_gates());
    run(&mut honest, 2..50, 2);
    tick(&mut honest, 50, &[]);
    let shared = honest.share(5, at(50)).unwrap();
    let told = corrected(&shared);
    let moved = |by: f64| Correction {
        pose: Pose::new(shared.pose.x + by, shared.pose.y, shared.pose.phi),
        ..told
    };
    let sigma = shared.covariance[(0, 0)].sqrt();
    let lies = [
        (moved(5.0 * sigma), Refusal::TooFar),
        (moved(1.0), Refusal::TooFar),
        (moved(100.0), Refusal::TooFar),
        (
            Correction {
                covariance: 1e-7 * shared.covariance,
                ..told
            },
            Refusal::TooCertain,
        ),
        (
            Correction {
                covariance: 1.1 * shared.covariance,
                ..told
            },
            Refusal::LessCertain,
        ),
        (Correction { slot: 9, ..told }, Refusal::TookNoPart),
        (Correction { slot: 4, ..told }, Refusal::TookNoPart),
        (
            Correction {
                factor: 6.0,
                ..told
            },
            Refusal::Factor,
        ),
    ];
    for (lie, why) in lies {
        let (mut lied_to, mut other) = (honest.clone(), honest.clone());
        let verdicts = tick(&mut lied_to, 51, &[correct(51, &lie)]);
        assert_eq!(verdicts, [Verdict::NotFollowed(why)], "{lie:?}");
        tick(&mut other, 51, &[]);
        assert_eq!(believed(&lied_to, 51), believed(&other, 51));
    }
    assert_eq!(
        tick(&mut honest, 51, &[correct(51, &told)]),
        [Verdict::Heard]
    );
}

/// The second is for the same slot, and honest: the belief that it was made of is not there any more.
#[test]
fn a_slot_is_corrected_once() {
    let mut robot = joined(&wide_gates());
    run(&mut robot, 2..50, 2);
    tick(&mut robot, 50, &[]);
    let told = corrected(&robot.share(5, at(50)).unwrap());
    let again = Correction {
        covariance: 0.9 * told.covariance,
        ..told
    };
    let other = word(
        51,
        9,
        Deed::Correct {
            slot: again.slot,
            pose: again.pose,
            covariance: Covariance3::new(again.covariance).unwrap(),
            factor: 1.0,
        },
    );
    let mut once = robot.clone();
    tick(&mut once, 51, &[correct(51, &told)]);
    let mut twice = once.clone();
    let refused = tick(&mut twice, 52, &[other]);
    assert_eq!(refused, [Verdict::NotFollowed(Refusal::TookNoPart)]);
    tick(&mut once, 52, &[]);
    assert_eq!(believed(&twice, 52), believed(&once, 52));
}

#[test]
fn what_the_team_went_on_without_is_taken_back_to_the_bit() {
    let mut robot = joined(&wide_gates());
    run(&mut robot, 2..60, 2);
    let mut other = robot.clone();
    for now in 60..63 {
        tick(&mut other, now, &[]);
    }
    tick(&mut robot, 60, &[]);
    let told = corrected(&robot.share(6, at(60)).unwrap());
    tick(&mut robot, 61, &[correct(61, &told)]);
    tick(&mut robot, 62, &[word(62, 7, Deed::Undo(Some(5)))]);
    assert_eq!(believed(&robot, 62), believed(&other, 62));
    let impossible = tick(&mut robot, 63, &[word(63, 8, Deed::Undo(Some(5)))]);
    assert_eq!(impossible, [Verdict::NotFollowed(Refusal::TookNoPart)]);
}

/// A person says where it is, a second before that leaves the history: what was shared meanwhile is of another belief.
#[test]
fn who_is_set_joins_anew_and_old_corrections_act_on_nothing() {
    let mut settings = settings();
    settings.position_gate = f64::INFINITY;
    let said = PoseSaid {
        stamp: at(100),
        origin: Origin::counted(1),
        pose: Pose::new(40.0, 7.0, 1.0),
        covariance: Covariance3::diagonal([0.01, 0.01, 0.01]).unwrap(),
        set: true,
    };
    let mut robot = joined(&settings);
    let mut shares = run(&mut robot, 2..100, 2);
    tick(&mut robot, 100, &[Measurement::Pose(said)]);
    shares.extend(run(&mut robot, 101..150, 2));
    assert_eq!(shares.last().unwrap().standing, Standing::Since(13));
    // It leaves the history between these slots.
    let mut joins = None;
    for now in 150..200 {
        tick(&mut robot, now, &[]);
        if now % EVERY == 0 && now > 155 {
            let shared = robot.share((now / EVERY).cast_unsigned(), at(now)).unwrap();
            joins.get_or_insert((now, shared));
        }
    }
    let (first, shared) = joins.unwrap();
    let slot = (first / EVERY).cast_unsigned();
    assert_eq!(shared.standing, Standing::Joining(slot));
    assert!((shared.pose.x - 40.0).abs() < 3.0, "{:?}", shared.pose);
}

#[test]
fn who_leaves_owes_all_of_its_belief() {
    let mut robot = joined(&wide_gates());
    run(&mut robot, 2..60, 2);
    let before = believed(&robot, 59);
    assert_eq!(before.parts.independent, Covariance3::ZERO);
    tick(&mut robot, 60, &[word(60, 9, Deed::Leave)]);
    let left = believed(&robot, 60);
    assert_eq!(left.parts.independent, Covariance3::ZERO);
    assert!(left.total().contains(&before.total().scaled(0.1)));
    assert_eq!(robot.share(6, at(60)), None);
    tick(&mut robot, 61, &[]);
    assert_ne!(believed(&robot, 61).parts.independent, Covariance3::ZERO);
}

/// Half of its team is in the other mode. What it hears would be counted twice; it is heard, not fused.
#[test]
fn what_neighbours_say_is_not_fused_in_rounds() {
    let said = |tick: i64| {
        Measurement::Neighbour(NeighbourPose {
            stamp: at(tick),
            origin: Origin {
                source: 3,
                ..Origin::counted(1)
            },
            pose: initial().pose,
            parts: Parts::independent(Covariance3::diagonal([1e-4; 3]).unwrap()),
        })
    };
    let mut robot = joined(&wide_gates());
    let mut other = robot.clone();
    tick(&mut robot, 2, &[said(2)]);
    tick(&mut other, 2, &[]);
    assert_eq!(believed(&robot, 2), believed(&other, 2));
    let mut apart = self::robot(&wide_gates());
    tick(&mut apart, 1, &[]);
    tick(&mut apart, 2, &[said(2)]);
    assert_ne!(believed(&robot, 2), believed(&apart, 2));
}

#[test]
fn a_slow_error_counts_as_white_noise_that_is_as_strong() {
    let mut robot = joined(&wide_gates());
    let slow = SlowError {
        variance: 0.04,
        memory: Span::from_seconds(60.0),
    };
    for now in 2..300 {
        let fix = PositionFix {
            stamp: at(now),
            origin: Origin::counted(now.cast_unsigned()),
            position: [1.0, 2.0],
            covariance: noise(),
            lever: [0.2, 0.1],
            slow,
        };
        let still = Measurement::Odometry(OdometrySample {
            source: 0,
            start: at(now - 1),
            stamp: at(now),
            motion: Motion::standstill([1e-6; 3]),
        });
        let _ = step(
            &mut robot,
            &TickInputs {
                stamp: at(now),
                measurements: &[still, fix.into()],
            },
        );
    }
    let shared = robot.share(30, at(299)).unwrap();
    let [xx, ..] = believed(&robot, 299).total().variances();
    // Not the error of 300 fixes that are independent, which is a thousandth.
    assert!((0.005..0.0101).contains(&xx), "{xx}");
    // What is left of its prior by Ψ alone is P without what noise brought.
    let prior = Matrix3::from_diagonal(&[0.01, 0.01, 1e-6].into());
    let left = shared.psi * prior * shared.psi.transpose();
    assert!(left[(0, 0)] <= shared.covariance[(0, 0)] && left[(0, 0)] > 0.0);
}

/// A robot that remembers for `history` corrected `late` ticks after a slot, and what it believes then.
fn corrected_after(history: Span, late: i64) -> (Vec<Verdict>, Belief, Shared) {
    const SLOT: i64 = 50;
    let mut settings = settings();
    settings.history = history;
    let covariance = Covariance3::diagonal([0.0025, 0.0025, 9e-4]).unwrap();
    let initial = Belief::independent(Pose::new(1.0, 2.0, 0.3), covariance);
    let mut robot = Estimator::new(settings, at(0), initial, vec![Slot::default(); 512]);
    tick(&mut robot, 1, &[word(1, 1, Deed::Join)]);
    for now in 2..=SLOT {
        tick(&mut robot, now, &[]);
    }
    let shared = robot.share(5, at(SLOT)).unwrap();
    for now in SLOT + 1..SLOT + late {
        tick(&mut robot, now, &[]);
    }
    let now = SLOT + late;
    let verdicts = tick(&mut robot, now, &[correct(now, &corrected(&shared))]);
    let belief = believed(&robot, now);
    (verdicts, belief, robot.share(99, at(now)).unwrap())
}

/// The document's figures: 0.4 mm after a second, 2.5 mm after four.
#[test]
fn after_the_history_a_correction_is_of_first_order() {
    for (late, most_m) in [(50, 0.4e-3), (200, 2.5e-3)] {
        let [exact, late] =
            [10_000, 400].map(|history| corrected_after(Span::from_millis(history), late));
        assert_eq!(
            (&exact.0[..], &late.0[..]),
            (&[Verdict::Heard][..], &[Verdict::Heard][..])
        );
        let (a, b) = (exact.1.pose, late.1.pose);
        let off = libm::hypot(a.x - b.x, a.y - b.y);
        assert!(off > 1e-5 && off <= most_m, "{off} m");
        let (p, q) = (exact.1.total().matrix(), late.1.total().matrix());
        assert!((p - q).abs().max() <= 0.02 * p.abs().max(), "{p} {q}");
        assert_eq!(
            (exact.2.standing, late.2.standing),
            (Standing::Since(5), Standing::Since(5))
        );
        assert!((exact.2.psi - late.2.psi).abs().max() < 0.05);
    }
    let (verdicts, ..) = corrected_after(Span::from_millis(400), 201);
    assert_eq!(verdicts, [Verdict::TooOld]);
}

/// What comes later than that correction, of before it, is heard as if it had come in order.
#[test]
fn what_is_measured_before_a_late_correction_is_taken_with_it() {
    let run = |is_late: bool| {
        let mut settings = settings();
        settings.history = Span::from_millis(400);
        let mut robot = joined(&settings);
        for now in 2..=10 {
            tick(&mut robot, now, &[]);
        }
        let shared = robot.share(1, at(10)).unwrap();
        let seen = fix(55, believed(&robot, 10).pose.to_vector().xy().into());
        for now in 11..=70 {
            let mut more = Vec::new();
            if now == if is_late { 65 } else { 55 } {
                more.push(seen);
            }
            if now == 60 {
                more.push(correct(now, &corrected(&shared)));
            }
            let verdicts = tick(&mut robot, now, &more);
            assert!(verdicts.iter().all(|it| *it == Verdict::Heard));
        }
        (believed(&robot, 70), robot.share(7, at(70)).unwrap())
    };
    let (prompt, late) = (run(false), run(true));
    assert_eq!(prompt, late);
    assert_eq!(prompt.1.standing, Standing::Since(1));
}
