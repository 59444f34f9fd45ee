//! A robot's own part: whenever a correction comes, it is as if it had come at once; and nothing allocates.

use coloc_counting::{Calls, calls_during};
use coloc_estimator::noise::OdometryNoise;
use coloc_estimator::{Covariance2, Motion, Pose};
use coloc_rounds::member::Settings;
use coloc_rounds::model;
use coloc_rounds::{Correction, Member, Refusal, Standing, Taken};
use nalgebra::Matrix3;

const STEP_NS: i64 = 20_000_000;

fn settings(history: usize) -> Settings {
    Settings {
        robots: 5,
        fix_gate: coloc_estimator::gate::CHI2_2_99,
        correction_gate: coloc_rounds::gate::CHI2_3_ONE_IN_A_MILLION,
        history,
    }
}

fn member(history: usize) -> Member {
    let covariance = Matrix3::from_diagonal(&[0.01, 0.01, 0.001].into());
    let belief = (Pose::new(1.0, 2.0, 3.0), covariance);
    Member::new(settings(history), 0, belief, Standing::Since(0))
}

fn noise() -> Covariance2 {
    Covariance2::diagonal([0.01, 0.01]).expect("positive")
}

fn motion(step: i64) -> Motion {
    #[allow(clippy::cast_precision_loss)]
    let turn = 0.3 - 0.01 * (step % 40) as f64;
    OdometryNoise::paper().nonholonomic([0.4, turn])
}

/// Where the wheels alone lead.
fn place(step: i64) -> Pose {
    let start = Pose::new(1.0, 2.0, 3.0);
    (1..=step).fold(start, |pose, step| {
        model::drive(&pose, &motion(step), 0.02).pose
    })
}

/// Steps from `from` to `to`, with a fix at every fifth.
fn drive(member: &mut Member, from: i64, to: i64) {
    for step in from + 1..=to {
        member.drive(step * STEP_NS, motion(step), 0.02);
        if step % 5 == 0 {
            let pose = place(step);
            let outcome = member.fix(step * STEP_NS, [pose.x + 0.03, pose.y - 0.02], noise());
            assert!(outcome.accepted);
        }
    }
}

/// What a round may have made of what was shared.
fn correction(shared: &coloc_rounds::Shared) -> Correction {
    let Pose { x, y, phi } = shared.pose;
    Correction {
        slot: shared.slot,
        pose: Pose::new(x + 0.01, y - 0.02, phi + 0.005),
        covariance: shared.covariance * 0.6,
        factor: 1.0,
    }
}

fn bits(member: &Member) -> Vec<u64> {
    let (pose, covariance) = member.estimate();
    let pose = [pose.x, pose.y, pose.phi];
    pose.iter()
        .chain(covariance.iter())
        .map(|it| it.to_bits())
        .collect()
}

/// A drive with slots at 50, 100 and 150 whose corrections come `late` steps after them, in any order.
fn driven(late: [i64; 3]) -> Member {
    let mut member = member(512);
    let mut due: Vec<(i64, Correction)> = Vec::new();
    for step in 0..250 {
        drive(&mut member, step, step + 1);
        let place = [50, 100, 150].iter().position(|it| *it == step + 1);
        if let Some(place) = place {
            let shared = member.share(place as u64 + 1);
            due.push((step + 1 + late[place], correction(&shared)));
        }
        while let Some(index) = due.iter().position(|(at, _)| *at <= step + 1) {
            let (_, told) = due.remove(index);
            assert_eq!(member.correct(&told), Ok(Taken::Exact));
        }
    }
    member
}

#[test]
fn a_late_correction_gives_the_bits_of_a_prompt_one() {
    // What is shared at the next slot is of after it, as it is with a leader who leaves out whoever missed a round.
    let prompt = driven([0, 0, 0]);
    for late in [[1, 1, 1], [5, 7, 30], [49, 49, 99]] {
        assert_eq!(bits(&driven(late)), bits(&prompt), "{late:?}");
    }
}

#[test]
fn a_correction_that_is_taken_back_was_never_there() {
    let mut plain = member(512);
    let mut other = plain.clone();
    for it in [&mut plain, &mut other] {
        drive(it, 0, 50);
    }
    let shared = other.share(1);
    plain.share(1);
    assert_eq!(other.correct(&correction(&shared)), Ok(Taken::Exact));
    assert_eq!(other.standing(), Standing::Since(1));
    for it in [&mut plain, &mut other] {
        drive(it, 50, 73);
    }
    assert_ne!(bits(&plain), bits(&other));
    assert!(other.undo(Some(0)));
    assert_eq!(
        (bits(&plain), other.standing()),
        (bits(&other), Standing::Since(0))
    );
    assert!(!other.undo(None), "nothing is left to take back");
}

#[test]
fn a_correction_is_taken_back_that_nothing_followed() {
    let mut member = member(512);
    drive(&mut member, 0, 5);
    let before = bits(&member);
    let shared = member.share(1);
    assert_eq!(member.correct(&correction(&shared)), Ok(Taken::Exact));
    assert!(member.undo(Some(0)));
    assert_eq!(bits(&member), before);
}

#[test]
fn after_the_history_a_correction_is_of_first_order() {
    let run = |history: usize| {
        let mut member = member(history);
        drive(&mut member, 0, 50);
        let shared = member.share(1);
        for step in 51..=100 {
            member.drive(step * STEP_NS, motion(step), 0.02);
        }
        let taken = member.correct(&correction(&shared));
        (taken, member.estimate(), member.standing())
    };
    let (exact, late) = (run(512), run(32));
    assert_eq!((exact.0, late.0), (Ok(Taken::Exact), Ok(Taken::FirstOrder)));
    assert_eq!((exact.2, late.2), (Standing::Since(1), Standing::Since(1)));
    let ((a, p), (b, q)) = (exact.1, late.1);
    let off = libm::hypot(a.x - b.x, a.y - b.y);
    assert!((1e-9..2e-3).contains(&off), "{off} m");
    assert!((p - q).abs().max() < 0.05 * p.diagonal().max() && q.cholesky().is_some());
}

#[test]
fn who_took_no_part_takes_no_correction() {
    let mut member = member(512);
    drive(&mut member, 0, 10);
    let first = member.share(1);
    drive(&mut member, 10, 20);
    let second = member.share(2);
    let before = bits(&member);
    let foreign = Correction {
        slot: 3,
        ..correction(&second)
    };
    assert_eq!(member.correct(&foreign), Err(Refusal::TookNoPart));
    assert_eq!(bits(&member), before);
    assert!(member.correct(&correction(&second)).is_ok());
    let after = bits(&member);
    assert_eq!(
        member.correct(&correction(&first)),
        Err(Refusal::TookNoPart)
    );
    member.join(3);
    assert_eq!(
        member.correct(&correction(&second)),
        Err(Refusal::TookNoPart)
    );
    assert_eq!(bits(&member), after);
}

#[test]
fn a_fix_that_comes_late_is_as_one_that_came_at_once_and_an_ancient_one_is_not_taken() {
    let run = |late: bool| {
        let mut member = member(512);
        drive(&mut member, 0, 12);
        let fix = |member: &mut Member| member.fix(12 * STEP_NS, [1.05, 2.0], noise());
        if !late {
            assert!(fix(&mut member).accepted);
        }
        for step in 13..=14 {
            let motion = OdometryNoise::paper().nonholonomic([0.4, 0.1]);
            member.drive(step * STEP_NS, motion, 0.02);
        }
        if late {
            assert!(fix(&mut member).accepted);
        }
        bits(&member)
    };
    assert_eq!(run(false), run(true));
    let mut member = member(16);
    drive(&mut member, 0, 100);
    let before = bits(&member);
    for (stamp, x) in [
        (STEP_NS, 1.0),
        (101 * STEP_NS, 1.0),
        (100 * STEP_NS, f64::NAN),
    ] {
        assert!(!member.fix(stamp, [x, 2.0], noise()).accepted);
    }
    assert_eq!(bits(&member), before);
}

#[test]
fn nothing_allocates() {
    let mut member = member(64);
    drive(&mut member, 0, 500);
    let ((), calls) = calls_during(|| {
        for slot in 1..100_i64 {
            let step = 500 + 10 * slot;
            drive(&mut member, step - 10, step - 3);
            let shared = member.share(slot.unsigned_abs());
            drive(&mut member, step - 3, step);
            assert_eq!(member.correct(&correction(&shared)), Ok(Taken::Exact));
        }
    });
    assert_eq!(calls, Calls::NONE);
}

#[test]
fn a_fix_that_only_fits_once_a_correction_has_come_counts_then() {
    let run = |late: bool| {
        let mut member = member(512);
        drive(&mut member, 0, 50);
        let shared = member.share(1);
        let Pose { x, y, phi } = shared.pose;
        let told = Correction {
            slot: 1,
            pose: Pose::new(x + 0.2, y, phi),
            covariance: shared.covariance * 0.2,
            factor: 1.0,
        };
        if !late {
            assert_eq!(member.correct(&told), Ok(Taken::Exact));
        }
        member.drive(51 * STEP_NS, motion(51), 0.02);
        let accepted = member.fix(51 * STEP_NS, [x + 0.45, y], noise()).accepted;
        if late {
            assert_eq!(member.correct(&told), Ok(Taken::Exact));
        }
        (accepted, bits(&member))
    };
    let (prompt, late) = (run(false), run(true));
    assert_eq!((prompt.0, late.0), (true, false));
    assert_eq!(prompt.1, late.1);
}
