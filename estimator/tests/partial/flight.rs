//! The same five robots, each with its estimator: what they tell one another comes a tick later, what is answered two.

use coloc_estimator::partial::Reading;
use coloc_estimator::{
    Answer, Belief, Covariance2, Covariance3, Estimator, FoundSettings, Measurement, Motion,
    OdometrySample, Origin, PartialSighting, Parts, Pose, PositionFix, RobotId, SeenPart, Settings,
    SightingId, Slot, SlowError, Span, Stamp, TickInputs, Verdict, step,
};

use crate::case::{covariance, covariance2};
use crate::sequence::{Meta, Sequence, Step, compare};
use crate::support::read_vectors;

/// Of an answer, behind its sighting.
const TICKS_UNTIL_ALL_IS_THERE: usize = 2;

/// So little that it changes nothing: a robot that something is known of by others.
const NEXT_TO_NOTHING: f64 = 1e-30;

fn settings(meta: &Meta) -> Settings {
    Settings {
        partial: meta.settings(),
        position_gate: meta.gate,
        found: FoundSettings::OFF,
        ..Settings::default()
    }
}

fn start(meta: &Meta) -> Vec<Estimator<Vec<Slot>>> {
    let robots = meta.x0.iter().zip(&meta.P_i0);
    robots
        .map(|(&[x, y, phi], rows)| {
            let parts = Parts {
                independent: covariance(rows),
                dependent: Covariance3::diagonal([NEXT_TO_NOTHING; 3]).unwrap(),
            };
            let belief = Belief::gaussian(Pose::new(x, y, phi), parts);
            Estimator::new(
                settings(meta),
                Stamp::default(),
                belief,
                vec![Slot::default(); 256],
            )
        })
        .collect()
}

fn id(robot: usize) -> RobotId {
    RobotId(u16::try_from(robot).unwrap())
}

fn stamp_of(meta: &Meta, index: usize) -> Stamp {
    let period = Span::from_seconds(meta.dt).as_nanos();
    Stamp::from_nanos(period * i64::try_from(index + 1).unwrap())
}

/// What the robot itself measures.
fn own(step: &Step, meta: &Meta, index: usize, robot: usize) -> Vec<Measurement> {
    let stamp = stamp_of(meta, index);
    let [v, omega] = step.odometry[robot];
    let noise = Covariance2::diagonal([5.075 * v * v, 0.345]).unwrap();
    let mut all = vec![Measurement::Odometry(OdometrySample {
        source: 0,
        start: stamp - Span::from_seconds(meta.dt),
        stamp,
        motion: Motion::Nonholonomic {
            velocity: [v, omega],
            noise,
        },
    })];
    for (number, seen) in (0..).zip(&step.sightings) {
        if seen.observer == robot {
            all.push(Measurement::Partial(PartialSighting {
                stamp,
                origin: Origin::counted(number),
                observed: id(seen.observed),
                reading: Reading::Place(meta.sighting(seen)),
            }));
        }
    }
    for fix in step.dgps.iter().filter(|it| it.robot == robot) {
        all.push(Measurement::Fix(PositionFix {
            stamp,
            origin: Origin::default(),
            position: fix.y,
            covariance: covariance2(&meta.R_dgps),
            lever: [0.0; 2],
            slow: SlowError::default(),
        }));
    }
    all
}

/// The sighting, as the other one of the two names it.
fn from(robot: usize, sighting: SightingId) -> SightingId {
    SightingId {
        robot: id(robot),
        ..sighting
    }
}

/// A tick of `robot`; what it says is put into the mail of the next one.
fn tick(
    estimator: &mut Estimator<Vec<Slot>>,
    robot: usize,
    inputs: &TickInputs<'_>,
    mail: &mut [Vec<Measurement>],
) -> Vec<Verdict> {
    let outputs = step(estimator, inputs);
    assert_eq!((outputs.overflowed, outputs.folded_early), (0, 0));
    for seen in outputs.seen {
        mail[usize::from(seen.sighting.robot.0)].push(Measurement::Seen(SeenPart {
            stamp: seen.stamp,
            sighting: from(robot, seen.sighting),
            place: seen.place,
            asks: true,
        }));
    }
    for answer in outputs.answers {
        mail[usize::from(answer.sighting.robot.0)].push(Measurement::Answer(Answer {
            stamp: answer.stamp,
            sighting: from(robot, answer.sighting),
            place: answer.place,
            reading: None,
        }));
    }
    outputs.reports.iter().map(|it| it.verdict).collect()
}

#[test]
fn five_estimators_come_to_the_same() {
    let Some(sequence) = read_vectors::<Sequence>("tracking/sequence_coop.json") else {
        return;
    };
    let (meta, mut robots) = (&sequence.meta, start(&sequence.meta));
    let mut mail = vec![Vec::new(); robots.len()];
    let (mut compared, mut verdicts) = (0, Vec::new());
    for (index, now) in sequence.steps.iter().enumerate() {
        let delivered = std::mem::replace(&mut mail, vec![Vec::new(); robots.len()]);
        for (robot, (estimator, mut measurements)) in robots.iter_mut().zip(delivered).enumerate() {
            measurements.extend(own(now, meta, index, robot));
            let inputs = TickInputs {
                stamp: stamp_of(meta, index),
                measurements: &measurements,
            };
            verdicts.extend(tick(estimator, robot, &inputs, &mut mail));
        }
        if let Some(past) = index.checked_sub(TICKS_UNTIL_ALL_IS_THERE) {
            let beliefs: Vec<Belief> = robots
                .iter()
                .map(|it| it.belief_at(stamp_of(meta, past)).unwrap())
                .collect();
            compared += compare(past, &sequence.steps[past].expected, &beliefs);
        }
    }
    assert!(compared > 10, "{compared}");
    let stated: usize = sequence
        .steps
        .iter()
        .map(|it| it.fusions.len() + it.dgps.len())
        .sum();
    let count = |is: fn(&Verdict) -> bool| verdicts.iter().filter(|it| is(it)).count();
    let fused = count(|it| matches!(it, Verdict::Accepted { .. }));
    let gated = count(|it| matches!(it, Verdict::Gated { .. }));
    assert_eq!(fused + gated, verdicts.len());
    assert!(
        fused + gated <= stated && fused > 600 && gated > 5,
        "{fused} {gated} {stated}"
    );
}
