//! The estimate depends on when things were measured, never on when or in which order they arrived.
#![allow(clippy::unwrap_used)] // A test may panic.

use std::cell::Cell;
use std::collections::BTreeMap;

use coloc_estimator::partial::{Alone, BodySighting, Reading, ReadingNoise, SplitPosition};
use coloc_estimator::{
    Answer, Belief, Covariance2, Covariance3, Estimator, GYRO_SAMPLES, GlobalPose, GyroSample,
    GyroSettings, HeadingFix, HeadingOf, LandmarkSighting, LeaderPose, Measurement, Motion,
    NeighbourPose, OdometrySample, Origin, PartialSighting, Parts, Pose, PoseSaid, PositionFix,
    RobotId, SeenPart, Settings, Sighting, SightingId, Slot, SlowError, Span, Stamp, TickInputs,
    Verdict, WithGyro, assist, step,
};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

type Robot = Estimator<WithGyro<Vec<Slot>, Vec<GyroSample>>>;

const PERIOD_NS: i64 = 20_000_000;
/// Measurements are stamped within so many ticks.
const TICKS: i64 = 25;
/// By this tick everything has been delivered and is due.
const LAST_TICK: i64 = TICKS + 2;

/// The earliest moment whose belief depends on it.
fn begins(measurement: &Measurement) -> Stamp {
    match measurement {
        Measurement::Odometry(sample) => sample.start,
        Measurement::Gyro(sample) => sample.stamp - Span::from_nanos(7_500_000),
        other => other.stamp(),
    }
}

fn is_set(measurement: &Measurement) -> bool {
    matches!(measurement, Measurement::Pose(said) if said.set)
}

type Batch = Vec<Measurement>;

fn inputs_at(stamp: Stamp, measurements: &Batch) -> TickInputs<'_> {
    TickInputs {
        stamp,
        measurements,
    }
}

/// What arrives with each tick.
type Schedule = BTreeMap<i64, Batch>;

/// A measurement and the moments of its arrivals, as fractions of the time in which it may arrive.
#[derive(Clone, Debug)]
struct Delivery {
    input: Measurement,
    arrivals: Vec<f64>,
}

impl Delivery {
    /// Ticks that take it in: neither from the future nor too old.
    fn ticks(&self, settings: &Settings) -> (i64, i64) {
        let earliest = (self.input.stamp() - settings.future_tolerance).as_nanos();
        let latest = (begins(&self.input) + settings.history).as_nanos();
        (
            earliest.div_euclid(PERIOD_NS).max(0) + 1,
            latest.div_euclid(PERIOD_NS).min(LAST_TICK),
        )
    }

    /// It has a tick to arrive in.
    fn is_possible(&self, settings: &Settings) -> bool {
        let (first, last) = self.ticks(settings);
        let is_used = !matches!(self.input, Measurement::Gyro(_)) || settings.gyro.is_some();
        first <= last && is_used
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss)]
    fn arrival(&self, fraction: f64, settings: &Settings) -> i64 {
        let (first, last) = self.ticks(settings);
        first + (fraction * (last - first + 1) as f64) as i64
    }

    /// The first tick at or after its stamp, or the last that takes it in.
    fn prompt(&self, settings: &Settings) -> i64 {
        let due = (self.input.stamp().as_nanos() + PERIOD_NS - 1).div_euclid(PERIOD_NS);
        due.min(self.ticks(settings).1)
    }
}

fn ns(nanos: i64) -> Stamp {
    Stamp::from_nanos(nanos)
}

fn tick(index: i64) -> Stamp {
    ns(index * PERIOD_NS)
}

/// On a tick, so that stamps coincide, or anywhere.
fn stamps() -> impl Strategy<Value = Stamp> {
    prop_oneof![
        (1..=TICKS).prop_map(tick),
        (1..=TICKS * PERIOD_NS).prop_map(ns)
    ]
}

fn poses() -> impl Strategy<Value = Pose> {
    (-0.4..0.4, -0.4..0.4, -3.0..3.0).prop_map(|(x, y, phi)| Pose::new(x, y, phi))
}

fn covariances() -> impl Strategy<Value = Covariance3> {
    (0.001..0.1, 0.001..0.1, 0.001..0.3)
        .prop_map(|(x, y, phi)| Covariance3::diagonal([x, y, phi]).unwrap())
}

fn motions() -> impl Strategy<Value = Motion> {
    let holonomic = (-1.0..1.0, -1.0..1.0, -2.0..2.0).prop_map(|(x, y, omega): (f64, f64, f64)| {
        Motion::Holonomic {
            velocity: [x, y, omega],
            noise: Covariance3::diagonal([x * x, y * y, 0.3]).unwrap(),
        }
    });
    let nonholonomic =
        (-1.0..1.0, -2.0..2.0).prop_map(|(v, omega): (f64, f64)| Motion::Nonholonomic {
            velocity: [v, omega],
            noise: Covariance2::diagonal([v * v, 0.3]).unwrap(),
        });
    prop_oneof![1 => holonomic, 4 => nonholonomic]
}

/// Encoder samples end to end, some lost, some late against the tick.
fn encoder() -> impl Strategy<Value = Vec<Measurement>> {
    let jitter = prop_oneof![2 => Just(0), 1 => -9_000_000..9_000_000_i64];
    let sample = (prop::bool::weighted(0.85), jitter, motions());
    prop::collection::vec(sample, usize::try_from(TICKS).unwrap()).prop_map(|samples| {
        let ends: Vec<_> = (1..)
            .zip(&samples)
            .map(|(k, (_, jitter, _))| tick(k) + Span::from_nanos(*jitter))
            .collect();
        let starts = std::iter::once(ns(0)).chain(ends.iter().copied());
        let all = starts.zip(&ends).zip(&samples);
        all.filter(|(_, (received, ..))| *received)
            .map(|((start, &stamp), &(_, _, motion))| {
                Measurement::Odometry(OdometrySample {
                    source: 0,
                    start,
                    stamp,
                    motion,
                })
            })
            .collect()
    })
}

/// A sample that overlaps those of the encoder in any way.
fn odd_sample() -> impl Strategy<Value = Measurement> {
    (
        1..TICKS * PERIOD_NS - 200_000_000,
        1..200_000_000_i64,
        motions(),
    )
        .prop_map(|(start, length, motion)| {
            Measurement::Odometry(OdometrySample {
                source: 0,
                start: ns(start),
                stamp: ns(start + length),
                motion,
            })
        })
}

fn levers() -> impl Strategy<Value = [f64; 2]> {
    prop_oneof![Just([0.0; 2]), [-0.5..0.5, -0.5..0.5]]
}

fn slow_errors() -> impl Strategy<Value = SlowError> {
    let some = (0.001..0.1, 1..1000_i64).prop_map(|(variance, memory_ms)| SlowError {
        variance,
        memory: Span::from_millis(memory_ms),
    });
    prop_oneof![Just(SlowError::default()), some]
}

fn courses() -> impl Strategy<Value = HeadingOf> {
    let course =
        (0.1..0.6, levers()).prop_map(|(least_m_s, lever)| HeadingOf::Course { least_m_s, lever });
    prop_oneof![2 => Just(HeadingOf::Body), 1 => course]
}

/// A gyro at 200 Hz, some of its samples lost, some not in step, some where the wheels say something else.
fn gyro() -> impl Strategy<Value = Vec<Measurement>> {
    let jitter = prop_oneof![2 => Just(0), 1 => -2_000_000..2_000_000_i64];
    let sample = (prop::bool::weighted(0.8), jitter, -2.0..2.0);
    let all = prop::collection::vec(sample, usize::try_from(4 * TICKS).unwrap());
    let samples = all.prop_map(|samples| {
        let numbered = (1..).zip(samples).filter(|(_, (received, ..))| *received);
        numbered
            .map(|(number, (_, jitter, rate_radps))| {
                Measurement::Gyro(GyroSample {
                    stamp: ns(number * PERIOD_NS / 4 + jitter),
                    rate_radps,
                    ..GyroSample::default()
                })
            })
            .collect()
    });
    prop_oneof![1 => Just(vec![]), 2 => samples]
}

/// Range and bearing, or one of the two.
fn readings() -> impl Strategy<Value = Reading> {
    let numbers = (1.0..4.0, -3.0..3.0, 0.01..0.1, 0.0..0.05, 0..4);
    numbers.prop_map(|(range_m, bearing_rad, white, slow, what)| {
        let mount = Pose::new(0.1, -0.2, 0.3);
        match what {
            0 => Reading::Alone(Alone::Bearing {
                bearing_rad,
                variances: [white, slow],
                mount,
            }),
            1 => Reading::Alone(Alone::Range {
                range_m,
                variances: [white, slow],
                mount,
            }),
            _ => {
                let noise = ReadingNoise {
                    white: [white; 2],
                    slow: [slow; 2],
                };
                Reading::Place(BodySighting::of(range_m, bearing_rad, &mount, &noise))
            }
        }
    })
}

fn places() -> impl Strategy<Value = SplitPosition> {
    (-0.5..0.5, -0.5..0.5, 0.0..0.1, 0.01..0.1).prop_map(|(x, y, own, shared)| SplitPosition {
        position: [x, y],
        independent: Covariance2::diagonal([own, own]).unwrap(),
        dependent: Covariance2::diagonal([shared, shared]).unwrap(),
    })
}

/// A sighting that says a part, what another robot says that has seen this one so, or a landmark.
fn part() -> impl Strategy<Value = Measurement> {
    let robots = || (2..6_u16).prop_map(RobotId);
    let sighting = (stamps(), robots(), readings()).prop_map(|(stamp, observed, reading)| {
        Measurement::Partial(PartialSighting {
            stamp,
            origin: Origin::default(),
            observed,
            reading,
        })
    });
    let place = prop::option::weighted(0.8, places());
    let seen =
        (stamps(), robots(), place, any::<bool>()).prop_map(|(stamp, robot, place, asks)| {
            Measurement::Seen(SeenPart {
                stamp,
                sighting: SightingId {
                    robot,
                    ..SightingId::default()
                },
                place,
                asks,
            })
        });
    let landmark = (stamps(), readings(), places()).prop_map(|(stamp, reading, place)| {
        Measurement::Landmark(LandmarkSighting {
            stamp,
            origin: Origin::default(),
            landmark: 7,
            reading,
            position: place.position,
            covariance: place.dependent,
        })
    });
    prop_oneof![4 => sighting, 3 => seen, 1 => landmark]
}

/// Two of three sightings that say a part are answered.
fn answer(input: &Measurement) -> Option<Measurement> {
    let Measurement::Partial(sighting) = input else {
        return None;
    };
    let number = sighting.origin.sequence;
    let variance = Covariance2::diagonal([0.02, 0.05]).unwrap();
    #[allow(clippy::cast_precision_loss)] // A small number.
    let x = 0.01 * number as f64;
    (number % 3 > 0).then(|| {
        Measurement::Answer(Answer {
            stamp: sighting.stamp,
            sighting: sighting.id(),
            place: SplitPosition {
                position: [x, 1.0],
                independent: variance,
                dependent: variance,
            },
            reading: None,
        })
    })
}

/// Nobody answers before it was asked.
fn causal(mut deliveries: Vec<Delivery>) -> Vec<Delivery> {
    let asked: BTreeMap<SightingId, f64> = deliveries
        .iter()
        .filter_map(|it| match &it.input {
            Measurement::Partial(sighting) => Some((sighting.id(), &it.arrivals)),
            _ => None,
        })
        .map(|(id, arrivals)| (id, arrivals.iter().copied().fold(1.0, f64::min)))
        .collect();
    for delivery in &mut deliveries {
        if let Measurement::Answer(answer) = &delivery.input {
            let earliest = asked[&answer.sighting];
            let arrivals = delivery.arrivals.iter_mut();
            arrivals.for_each(|it| *it = it.max(earliest));
        }
    }
    deliveries
}

/// Its sequence is filled in by [`world`].
fn measurement() -> impl Strategy<Value = Measurement> {
    let robots = || (2..6_u16).prop_map(RobotId);
    let sighting = (stamps(), robots(), poses(), covariances()).prop_map(
        |(stamp, observed, relative, covariance)| {
            Measurement::Sighting(Sighting {
                stamp,
                origin: Origin::default(),
                observed,
                relative,
                covariance,
            })
        },
    );
    let neighbour = (stamps(), robots(), poses(), covariances(), 0.0..1.0).prop_map(
        |(stamp, sender, pose, total, own)| {
            let parts = Parts {
                independent: total.scaled(own),
                dependent: total.scaled(1.0 - own),
            };
            Measurement::Neighbour(NeighbourPose {
                stamp,
                origin: Origin {
                    source: sender.0,
                    ..Origin::default()
                },
                pose,
                parts,
            })
        },
    );
    let leaders = (stamps(), robots(), poses(), covariances(), 0.0..1.0);
    let leader = leaders.prop_map(|(stamp, leader, pose, total, own)| {
        let parts = Parts {
            independent: total.scaled(own),
            dependent: total.scaled(1.0 - own),
        };
        Measurement::Assist(LeaderPose {
            stamp,
            leader,
            slot: assist::slot::Slot::default(),
            said: GlobalPose { pose, parts },
        })
    });
    let fix = (stamps(), -0.5..0.5, -0.5..0.5, levers(), slow_errors()).prop_map(
        |(stamp, x, y, lever, slow)| {
            let covariance = Covariance2::diagonal([0.01, 0.01]).unwrap();
            Measurement::Fix(PositionFix {
                stamp,
                origin: Origin::default(),
                position: [x, y],
                covariance,
                lever,
                slow,
            })
        },
    );
    let heading = (stamps(), -0.5..0.5, 0.001..0.1, slow_errors(), courses()).prop_map(
        |(stamp, heading_rad, variance, slow, of)| {
            Measurement::Heading(HeadingFix {
                stamp,
                origin: Origin::default(),
                heading_rad,
                variance,
                slow,
                of,
            })
        },
    );
    let said = (stamps(), poses(), covariances(), any::<bool>()).prop_map(
        |(stamp, pose, covariance, set)| {
            Measurement::Pose(PoseSaid {
                stamp,
                origin: Origin::default(),
                pose,
                covariance,
                set,
            })
        },
    );
    prop_oneof![2 => sighting, 6 => neighbour, 3 => leader, 4 => fix, 3 => heading, 1 => said, 8 => part()]
}

fn with_sequence(mut input: Measurement, sequence: u64) -> Measurement {
    match &mut input {
        Measurement::Odometry(_) => {}
        Measurement::Gyro(sample) => sample.origin.sequence = sequence,
        Measurement::Sighting(sighting) => sighting.origin.sequence = sequence,
        Measurement::Track(track) => track.0.origin.sequence = sequence,
        Measurement::Neighbour(neighbour) => neighbour.origin.sequence = sequence,
        Measurement::Assist(pose) => pose.slot = assist::slot::Slot(sequence.cast_signed()),
        Measurement::Heading(heading) => heading.origin.sequence = sequence,
        Measurement::Fix(fix) => fix.origin.sequence = sequence,
        Measurement::Pose(said) => said.origin.sequence = sequence,
        Measurement::Round(word) => word.origin.sequence = sequence,
        Measurement::Partial(sighting) => sighting.origin.sequence = sequence,
        Measurement::Landmark(sighting) => sighting.origin.sequence = sequence,
        Measurement::Seen(seen) => seen.sighting.sequence = sequence,
        Measurement::Ask(ask) => ask.sighting.sequence = sequence,
        Measurement::Answer(answer) => answer.sighting.sequence = sequence,
    }
    input
}

/// A set of measurements, shuffled, each with its arrivals; one in five arrives twice.
fn world() -> impl Strategy<Value = Vec<Delivery>> {
    let odd = prop::collection::vec(odd_sample(), 0..3);
    let measured = prop::collection::vec(measurement(), 0..25);
    let inputs = (encoder(), gyro(), odd, measured).prop_map(|(encoder, gyro, odd, measured)| {
        let all = encoder.into_iter().chain(gyro).chain(odd).chain(measured);
        let mut all: Vec<_> = all
            .zip(0..)
            .map(|(input, sequence)| with_sequence(input, sequence))
            .collect();
        let answers: Vec<_> = all.iter().filter_map(answer).collect();
        all.extend(answers);
        all
    });
    let arrivals = || prop_oneof![4 => prop::collection::vec(0.0..1.0, 1), 1 => prop::collection::vec(0.0..1.0, 2)];
    inputs.prop_shuffle().prop_flat_map(move |inputs| {
        let deliveries = inputs
            .into_iter()
            .map(|input| arrivals().prop_map(move |arrivals| Delivery { input, arrivals }));
        deliveries.collect::<Vec<_>>().prop_map(causal)
    })
}

fn settings() -> impl Strategy<Value = Settings> {
    // Longer than everything, so that nothing leaves the history; and short, so that most does.
    let history = prop_oneof![Just(1000), Just(150)].prop_map(Span::from_millis);
    (history, any::<bool>()).prop_map(|(history, paper)| Settings {
        history,
        gyro: (!paper).then_some(GyroSettings::ORDINARY),
        ..if paper {
            Settings::paper()
        } else {
            Settings::default()
        }
    })
}

fn start(settings: &Settings) -> Robot {
    let initial = Belief::independent(
        Pose::default(),
        Covariance3::diagonal([0.01, 0.01, 0.01]).unwrap(),
    );
    let places = WithGyro {
        slots: vec![Slot::default(); 256],
        samples: vec![GyroSample::default(); GYRO_SAMPLES],
    };
    Estimator::new(*settings, ns(0), initial, places)
}

/// What a run said on its way.
#[derive(Default)]
struct Account {
    verdicts: Vec<Verdict>,
    sent: usize,
    /// What was told of sightings that say a part, and answered.
    exchanged: [usize; 2],
}

/// Ticks through the schedule.
fn run(estimator: &mut Robot, schedule: &Schedule, ticks: impl Iterator<Item = i64>) -> Account {
    let mut account = Account::default();
    for index in ticks {
        let batch = schedule.get(&index).cloned().unwrap_or_default();
        let outputs = step(estimator, &inputs_at(tick(index), &batch));
        assert_eq!((outputs.overflowed, outputs.folded_early), (0, 0));
        account
            .verdicts
            .extend(outputs.reports.iter().map(|report| report.verdict));
        account.sent += outputs.outgoing.len();
        account.exchanged[0] += outputs.seen.len();
        account.exchanged[1] += outputs.answers.len();
    }
    account
}

fn as_scheduled(deliveries: &[Delivery], settings: &Settings) -> Schedule {
    let mut schedule = Schedule::new();
    for delivery in deliveries {
        for &fraction in &delivery.arrivals {
            schedule
                .entry(delivery.arrival(fraction, settings))
                .or_default()
                .push(delivery.input);
        }
    }
    schedule
}

fn promptly(deliveries: &[Delivery], settings: &Settings) -> Schedule {
    let mut schedule = Schedule::new();
    for delivery in deliveries {
        schedule
            .entry(delivery.prompt(settings))
            .or_default()
            .push(delivery.input);
    }
    schedule
}

fn bits(belief: &Belief) -> Vec<u64> {
    let pose = [belief.pose.x, belief.pose.y, belief.pose.phi];
    let parts = [belief.parts.independent, belief.parts.dependent];
    let entries = pose
        .into_iter()
        .chain(parts.into_iter().flat_map(|part| part.to_row_major()))
        .chain(belief.bend.to_array());
    entries.map(f64::to_bits).collect()
}

/// The beliefs at and between the ticks of the last 100 ms, and now.
fn final_beliefs(estimator: &Robot) -> Vec<Vec<u64>> {
    let moments = (0..=20).map(|back| tick(LAST_TICK) - Span::from_millis(5 * back));
    moments
        .map(|moment| {
            let estimate = estimator.extrapolated(moment);
            let gyro = estimate.gyro.map(|it| [it.bias, it.bias_variance]);
            let since = estimate.gyro.and_then(|it| it.slipping_since);
            let mut bits = bits(&estimator.belief_at(moment).unwrap());
            bits.extend(gyro.iter().flatten().map(|it| it.to_bits()));
            bits.extend(since.map(|it| it.as_nanos().cast_unsigned()));
            bits
        })
        .collect()
}

/// Runs `property` on 2000 cases, the same ones every time.
fn check<T: std::fmt::Debug>(cases: &impl Strategy<Value = T>, property: impl Fn(T)) {
    let config = Config {
        cases: 2000,
        failure_persistence: None,
        ..Config::default()
    };
    let mut runner =
        TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let result = runner.run(cases, |case| {
        property(case);
        Ok(())
    });
    result.unwrap();
}

#[test]
fn any_order_of_delivery_gives_the_same_bits() {
    let (accepted, gated, sent) = (Cell::new(0), Cell::new(0), Cell::new(0));
    let (not_moving, told, answered) = (Cell::new(0), Cell::new(0), Cell::new(0));
    check(&(settings(), world()), |(settings, mut deliveries)| {
        deliveries.retain(|delivery| delivery.is_possible(&settings));
        let (mut prompt, mut late) = (start(&settings), start(&settings));
        run(
            &mut prompt,
            &promptly(&deliveries, &settings),
            1..=LAST_TICK,
        );
        let account = run(
            &mut late,
            &as_scheduled(&deliveries, &settings),
            1..=LAST_TICK,
        );

        assert!(final_beliefs(&prompt) == final_beliefs(&late));
        let count = |wanted: fn(&Verdict) -> bool| {
            account
                .verdicts
                .iter()
                .filter(|verdict| wanted(verdict))
                .count()
        };
        let repeated: usize = deliveries
            .iter()
            .map(|delivery| delivery.arrivals.len() - 1)
            .sum();
        assert_eq!(count(|verdict| *verdict == Verdict::Duplicate), repeated);
        let set = deliveries.iter().filter(|it| is_set(&it.input)).count();
        let heard = count(|verdict| *verdict == Verdict::Heard);
        assert!(heard >= set, "{heard} of {set}");
        let (fused, refused) = (
            count(|verdict| matches!(verdict, Verdict::Accepted { .. })),
            count(|verdict| matches!(verdict, Verdict::Gated { .. })),
        );
        let still = count(|verdict| *verdict == Verdict::NotMoving);
        not_moving.set(not_moving.get() + still);
        assert_eq!(
            fused + refused + repeated + heard + still,
            account.verdicts.len(),
            "{:?}",
            account.verdicts
        );
        accepted.set(accepted.get() + fused);
        gated.set(gated.get() + refused);
        sent.set(sent.get() + account.sent);
        told.set(told.get() + account.exchanged[0]);
        answered.set(answered.get() + account.exchanged[1]);
    });
    assert!(
        accepted.get() > 1000 && gated.get() > 100 && sent.get() > 100,
        "the cases exercise everything"
    );
    assert!(not_moving.get() > 100, "{}", not_moving.get());
    assert!(told.get() > 1000 && answered.get() > 1000);
}

#[test]
fn one_batch_at_the_end_gives_the_same_bits_as_ticks_on_the_way() {
    let settings = Settings {
        gyro: Some(GyroSettings::ORDINARY),
        ..Settings::default()
    };
    check(&world(), |deliveries| {
        let (mut prompt, mut at_once) = (start(&settings), start(&settings));
        run(
            &mut prompt,
            &promptly(&deliveries, &settings),
            1..=LAST_TICK,
        );
        let mut everything = Batch::default();
        deliveries
            .iter()
            .rev()
            .for_each(|delivery| everything.push(delivery.input));
        run(
            &mut at_once,
            &Schedule::from([(LAST_TICK, everything)]),
            LAST_TICK..=LAST_TICK,
        );
        assert!(final_beliefs(&prompt) == final_beliefs(&at_once));
    });
}

/// One of each kind of measurement that is refused at tick `now`, and what must be said of them.
fn refused(now: i64, settings: &Settings, known: Measurement) -> Vec<(Measurement, Verdict)> {
    let fix = |stamp| {
        let covariance = Covariance2::diagonal([0.01, 0.01]).unwrap();
        Measurement::Fix(PositionFix {
            stamp,
            origin: Origin::counted(900),
            position: [0.1, 0.1],
            covariance,
            lever: [0.0; 2],
            slow: SlowError::default(),
        })
    };
    let instant = Span::from_nanos(1);
    let Measurement::Odometry(sample) = known else {
        panic!("{known:?}")
    };
    vec![
        (known, Verdict::Duplicate),
        (
            fix(tick(now) + settings.future_tolerance + instant),
            Verdict::FromFuture,
        ),
        (fix(tick(now) - settings.history - instant), Verdict::TooOld),
        (fix(ns(0)), Verdict::TooOld),
        (
            Measurement::Odometry(OdometrySample {
                start: sample.stamp,
                ..sample
            }),
            Verdict::EmptyInterval,
        ),
    ]
}

#[test]
fn what_is_refused_changes_nothing() {
    check(&(settings(), world()), |(settings, mut deliveries)| {
        deliveries.retain(|delivery| delivery.is_possible(&settings));
        let schedule = promptly(&deliveries, &settings);
        let halfway = TICKS / 2;
        let recent = |delivery: &&Delivery| {
            let age = halfway - delivery.prompt(&settings);
            matches!(delivery.input, Measurement::Odometry(_)) && (0..5).contains(&age)
        };
        let Some(known) = deliveries.iter().find(recent) else {
            return;
        };

        let (mut spared, mut pestered) = (start(&settings), start(&settings));
        run(&mut spared, &schedule, 1..=halfway);
        run(&mut pestered, &schedule, 1..=halfway);
        let (nuisances, expected): (Vec<_>, Vec<_>) =
            refused(halfway, &settings, known.input).into_iter().unzip();
        for (nuisance, expected) in nuisances.into_iter().zip(expected) {
            let batch = vec![nuisance];
            let before = pestered.extrapolated(tick(halfway)).belief;
            let outputs = step(&mut pestered, &inputs_at(tick(halfway), &batch));
            assert_eq!(
                outputs
                    .reports
                    .iter()
                    .map(|report| report.verdict)
                    .collect::<Vec<_>>(),
                [expected]
            );
            assert_eq!(bits(&outputs.estimate.belief), bits(&before));
        }
        run(&mut spared, &schedule, halfway + 1..=LAST_TICK);
        run(&mut pestered, &schedule, halfway + 1..=LAST_TICK);
        assert!(final_beliefs(&spared) == final_beliefs(&pestered));
    });
}
