//! A gyro beside the wheels: as a dense Kalman filter has it, in any order, with wheels that slip or are silent.
#![allow(clippy::unwrap_used)] // A test may panic.

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimate, Estimator, GYRO_SAMPLES, GyroSample, GyroSettings,
    GyroState, Measurement, Motion, NeighbourPose, OdometrySample, Origin, Parts, Pose,
    PositionFix, RobotId, Settings, Sighting, Slot, SlowError, Span, Stamp, TickInputs, WithGyro,
    step,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

const PERIOD_NS: i64 = 20_000_000;
const GYRO_NS: i64 = 5_000_000;
const DT_S: f64 = 0.02;

type Matrix7 = SMatrix<f64, 7, 7>;
type Vector7 = SVector<f64, 7>;
type Robot = Estimator<WithGyro<Vec<Slot>, Vec<GyroSample>>>;

const GYRO: GyroSettings = GyroSettings {
    noise: 4e-7,
    noise_per_turn: 0.0,
    bias: 0.0,
    bias_variance: 2.5e-3,
    bias_walk: 1e-9,
    period: Span::from_millis(5),
};

fn ns(nanos: i64) -> Stamp {
    Stamp::from_nanos(nanos)
}

fn settings() -> Settings {
    Settings {
        gyro: Some(GYRO),
        position_gate: f64::INFINITY,
        ..Settings::default()
    }
}

fn robot(settings: &Settings, parts: Parts) -> Robot {
    let belief = Belief::gaussian(Pose::default(), parts);
    let places = WithGyro {
        slots: vec![Slot::default(); 256],
        samples: vec![GyroSample::default(); GYRO_SAMPLES],
    };
    Estimator::new(*settings, ns(0), belief, places)
}

fn wheels(tick: i64, velocity: [f64; 3], variance: [f64; 3]) -> Measurement {
    Measurement::Odometry(OdometrySample {
        source: 0,
        start: ns((tick - 1) * PERIOD_NS),
        stamp: ns(tick * PERIOD_NS),
        motion: Motion::Holonomic {
            velocity,
            noise: Covariance3::diagonal(variance).unwrap(),
        },
    })
}

/// The four of a tick.
fn gyro(tick: i64, rate_radps: f64) -> impl Iterator<Item = Measurement> {
    (-3..=0).map(move |back| {
        Measurement::Gyro(GyroSample {
            stamp: ns(tick * PERIOD_NS + back * GYRO_NS),
            rate_radps,
            ..GyroSample::default()
        })
    })
}

fn fix(tick: i64, position: [f64; 2], variance: f64) -> Measurement {
    Measurement::Fix(PositionFix {
        stamp: ns(tick * PERIOD_NS),
        origin: Origin::counted(u64::try_from(tick).unwrap()),
        position,
        covariance: Covariance2::diagonal([variance; 2]).unwrap(),
        lever: [0.0; 2],
        slow: SlowError::default(),
    })
}

fn sighting(tick: i64) -> Measurement {
    Measurement::Sighting(Sighting {
        stamp: ns(tick * PERIOD_NS),
        origin: Origin::counted(u64::try_from(tick).unwrap()),
        observed: RobotId(2),
        relative: Pose::new(1.0, 0.5, 0.1),
        covariance: Covariance3::diagonal([1e-4; 3]).unwrap(),
    })
}

fn tick(robot: &mut Robot, at: i64, measurements: &[Measurement]) -> Estimate {
    let inputs = TickInputs {
        stamp: ns(at * PERIOD_NS),
        measurements,
    };
    let outputs = step(robot, &inputs);
    assert_eq!((outputs.overflowed, outputs.folded_early), (0, 0));
    outputs.estimate
}

#[allow(clippy::cast_precision_loss)]
fn nanos(count: i64) -> f64 {
    count as f64
}

/// Numbers between −1 and 1 that no two runs differ in.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        #[allow(clippy::cast_precision_loss)]
        let unit = (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        2.0 * unit - 1.0
    }
}

/// `[x, y, φ, b]` and the increments of the leg that passes.
struct Dense {
    mean: Vector7,
    covariance: Matrix7,
}

impl Dense {
    fn new(pose: &Matrix3<f64>) -> Self {
        let mut covariance = Matrix7::zeros();
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(pose);
        covariance[(3, 3)] = GYRO.bias_variance;
        Self {
            mean: Vector7::zeros(),
            covariance,
        }
    }

    /// The leg's increments, the gyro's angle, and the way along the arc.
    fn leg(&mut self, velocity: [f64; 3], variance: [f64; 3], rate: f64) {
        for (at, (u, q)) in velocity.into_iter().zip(variance).enumerate() {
            self.mean[4 + at] = u * DT_S;
            self.covariance[(4 + at, 4 + at)] = q * DT_S * DT_S;
        }
        let mut row = Vector7::zeros();
        (row[3], row[6]) = (DT_S, 1.0);
        self.correct(&row, rate * DT_S, GYRO.noise * DT_S);
        let (moved, map) = arc(&self.mean);
        self.mean = moved;
        self.covariance = map * self.covariance * map.transpose();
        self.covariance[(3, 3)] += GYRO.bias_walk * DT_S;
    }

    fn correct(&mut self, row: &Vector7, measured: f64, noise: f64) {
        let column = self.covariance * row;
        let sum = row.dot(&column) + noise;
        self.mean += column * ((measured - row.dot(&self.mean)) / sum);
        self.covariance -= column * column.transpose() / sum;
    }

    fn fix(&mut self, position: [f64; 2], noise: f64) {
        for (axis, measured) in position.into_iter().enumerate() {
            let mut row = Vector7::zeros();
            row[axis] = 1.0;
            self.correct(&row, measured, noise);
        }
    }
}

/// The pose after the increments, which are forgotten, and how its error depends on what was before, by differences.
fn arc(before: &Vector7) -> (Vector7, Matrix7) {
    let moved = |x: &Vector7| {
        let half = 0.5 * x[6];
        let g = half.sin() / half;
        let (sin, cos) = (x[2] + half).sin_cos();
        let mut after = Vector7::zeros();
        after[0] = x[0] + g * (cos * x[4] - sin * x[5]);
        after[1] = x[1] + g * (sin * x[4] + cos * x[5]);
        (after[2], after[3]) = (x[2] + x[6], x[3]);
        after
    };
    let mut map = Matrix7::zeros();
    for at in 0..7 {
        let mut by = Vector7::zeros();
        by[at] = 1e-6;
        let slope = (moved(&(before + by)) - moved(&(before - by))) / 2e-6;
        map.set_column(at, &slope);
    }
    (moved(before), map)
}

fn assert_same(estimate: &Estimate, dense: &Dense, at: i64) {
    let total = estimate.belief.total().matrix();
    let expected: Matrix3<f64> = dense.covariance.fixed_view::<3, 3>(0, 0).into();
    for row in 0..3 {
        for column in 0..3 {
            let scale = (expected[(row, row)] * expected[(column, column)]).sqrt();
            let error = (total[(row, column)] - expected[(row, column)]).abs() / scale;
            assert!(
                error < 2e-6,
                "{at}: ({row}, {column}) {error:e} {total} {expected}"
            );
        }
    }
    let pose = estimate.belief.pose.to_vector();
    let mean: Vector3<f64> = dense.mean.fixed_rows::<3>(0).into();
    assert!((pose - mean).norm() < 1e-7, "{at}: {pose} {mean}");
    let gyro = estimate.gyro.unwrap();
    let bias = (gyro.bias - dense.mean[3]).abs() / dense.covariance[(3, 3)].sqrt();
    let variance = gyro.bias_variance / dense.covariance[(3, 3)] - 1.0;
    assert!(
        bias < 1e-4 && variance.abs() < 1e-6,
        "{at}: {bias:e} {variance:e}"
    );
}

/// The joint filter in its two parts is one dense filter of seven numbers: on the way, at fixes, and with parts of any size, of
/// which a robot that is told of moves one into the other.
#[test]
fn pose_and_bias_are_those_of_a_dense_filter() {
    let own = Covariance3::diagonal([1e-6, 2e-6, 1e-8]).unwrap();
    let others =
        Covariance3::from_row_major([2e-6, 0.0, 1e-8, 0.0, 1e-6, 0.0, 1e-8, 0.0, 2e-9]).unwrap();
    for parts in [
        Parts::independent(own),
        Parts {
            independent: own,
            dependent: others,
        },
    ] {
        let (mut robot, mut dense) = (
            robot(&settings(), parts),
            Dense::new(&parts.total().matrix()),
        );
        let mut chance = Chance(7);
        for at in 1..=400 {
            let (velocity, variance) = if (120..200).contains(&at) {
                ([0.0; 3], [1e-12, 1e-12, 1e-9])
            } else {
                let turn = 0.4 * (0.02 * f64::from(i32::try_from(at).unwrap())).sin() + 1e-5;
                ([0.5, 0.02, turn], [1e-5, 1e-6, 1e-5])
            };
            let rate = velocity[2] + 0.03 + 1e-3 * chance.next();
            let mut batch = vec![wheels(at, velocity, variance)];
            batch.extend(gyro(at, rate));
            dense.leg(velocity, variance, rate);
            if at % 40 == 17 {
                batch.push(sighting(at));
            }
            if at % 10 == 3 {
                let position = [0, 1].map(|axis| dense.mean[axis] + 1e-3 * chance.next());
                batch.push(fix(at, position, 1e-6));
                dense.fix(position, 1e-6);
            }
            let estimate = tick(&mut robot, at, &batch);
            assert_same(&estimate, &dense, at);
        }
    }
}

fn known() -> Parts {
    Parts::independent(Covariance3::diagonal([1e-4, 1e-4, 1e-4]).unwrap())
}

const NOISE: [f64; 3] = [1e-4, 1e-6, 5e-5];

/// Wheels at 0.5 m/s that turn so, and a gyro that reads that.
fn drive(robot: &mut Robot, ticks: std::ops::Range<i64>, turn: f64, rate: f64) -> Estimate {
    let mut last = None;
    for at in ticks {
        let mut batch = vec![wheels(at, [0.5, 0.0, turn], NOISE)];
        batch.extend(gyro(at, rate));
        last = Some(tick(robot, at, &batch));
    }
    last.unwrap()
}

fn stand(robot: &mut Robot, ticks: std::ops::Range<i64>, rate: f64) -> Estimate {
    let mut last = None;
    for at in ticks {
        let mut batch = vec![wheels(at, [0.0; 3], [1e-10, 1e-10, 4e-6])];
        batch.extend(gyro(at, rate));
        last = Some(tick(robot, at, &batch));
    }
    last.unwrap()
}

fn state(estimate: &Estimate) -> GyroState {
    estimate.gyro.unwrap()
}

#[test]
fn a_robot_that_stands_learns_the_bias() {
    let mut robot = robot(&settings(), known());
    let estimate = stand(&mut robot, 1..251, 0.04);
    let GyroState {
        bias,
        bias_variance,
        slipping_since,
        ..
    } = state(&estimate);
    let sigma = bias_variance.sqrt();
    assert!(
        (bias - 0.04).abs() < 3.0 * sigma && sigma < 5e-4,
        "{bias} {sigma}"
    );
    assert_eq!(slipping_since, None);
    assert!(estimate.belief.pose.phi.abs() < 1e-3);
}

/// 0.5 rad/s of wheels that slip is no turn; the robot's heading is the gyro's, and later that of both again.
#[test]
fn wheels_that_slip_do_not_turn_the_robot_and_teach_nothing() {
    let mut robot = robot(&settings(), known());
    let before = state(&stand(&mut robot, 1..251, 0.04));
    let slips = drive(&mut robot, 251..501, 0.5, 0.04);
    let sigma = slips.belief.total().variances()[2].sqrt();
    assert!(
        slips.belief.pose.phi.abs() < 3.0 * sigma && sigma < 0.03,
        "{sigma}"
    );
    let after = state(&slips).slipping_since.unwrap() - ns(250 * PERIOD_NS);
    assert!(after <= Span::from_millis(60), "{after:?}");
    assert_eq!(state(&slips).bias.to_bits(), before.bias.to_bits());
    assert!((slips.velocity[2]).abs() < 1e-2 && slips.driven.phi.abs() < 0.01);
    let holds = drive(&mut robot, 501..561, 0.1, 0.14);
    assert_eq!(state(&holds).slipping_since, None);
}

/// Said to be known to 0.05 rad/s, and off by a whole rad/s: the robot stands and gyro and wheels disagree without end.
/// Each sample is the mean rate since the one before, in step with the ticks or a millisecond before them. The headings part by no more than
/// the rate changes in that time, however long the robot drives.
#[test]
fn a_gyro_out_of_step_with_the_wheels_loses_no_turn() {
    let heading = |seconds: f64| 0.8 * libm::sin(2.0 * seconds);
    let mut settings = settings();
    settings.gyro = settings.gyro.map(|gyro| GyroSettings {
        noise: 1e-12,
        bias_variance: 1e-16,
        bias_walk: 0.0,
        ..gyro
    });
    let mut robots = [0, -1_000_000].map(|offset_ns| (offset_ns, robot(&settings, known())));
    for at in 1..=3000 {
        let mut headings = [0.0; 2];
        for ((offset_ns, robot), told) in robots.iter_mut().zip(&mut headings) {
            let samples = gyro(at, 0.0).map(|sample| {
                let Measurement::Gyro(sample) = sample else {
                    unreachable!("a gyro's")
                };
                let stamp = ns(sample.stamp.as_nanos() + *offset_ns);
                let until = 1e-9 * nanos(stamp.as_nanos());
                let turned = heading(until) - heading(until - 0.005);
                Measurement::Gyro(GyroSample {
                    stamp,
                    rate_radps: turned / 0.005,
                    ..sample
                })
            });
            let mut heard = vec![wheels(at, [1.0, 0.0, 0.0], [1e-4, 1e-4, 100.0])];
            heard.extend(samples);
            *told = tick(robot, at, &heard).belief.pose.phi;
        }
        let [in_step, out_of_step] = headings;
        assert!((in_step - out_of_step).abs() < 2e-5, "{at}: {headings:?}");
    }
}

#[test]
fn a_bias_that_nobody_thought_possible_is_learnt_in_the_end() {
    let mut robot = robot(&settings(), known());
    let estimate = stand(&mut robot, 1..501, 1.0);
    assert!(state(&estimate).slipping_since.is_some());
    let estimate = stand(&mut robot, 501..6001, 1.0);
    let GyroState {
        bias,
        slipping_since,
        ..
    } = state(&estimate);
    assert!((bias - 1.0).abs() < 0.01, "{bias}");
    assert_eq!(slipping_since, None);
}

/// Ten seconds without wheels: more samples than are kept, none is refused, and how often one asks changes no bit.
#[test]
fn without_wheels_the_gyro_turns_the_robot_for_as_long_as_it_takes() {
    let bits = |every: i64| {
        let mut robot = robot(&settings(), known());
        stand(&mut robot, 1..251, 0.04);
        let mut waiting = Vec::new();
        for at in 251..751 {
            waiting.extend(gyro(at, 0.14));
            if at % every == 0 {
                let inputs = TickInputs {
                    stamp: ns(at * PERIOD_NS),
                    measurements: &waiting,
                };
                let outputs = step(&mut robot, &inputs);
                assert_eq!(outputs.reports, []);
                waiting.clear();
            }
        }
        let estimate = robot.extrapolated(ns(750 * PERIOD_NS));
        let sigma = estimate.belief.total().variances()[2].sqrt();
        let error = (estimate.belief.pose.phi - 1.0).abs();
        assert!(error < 3.0 * sigma && sigma < 0.03, "{error} {sigma}");
        assert!((estimate.velocity[2] - 0.1).abs() < 0.01);
        let Pose { x, y, phi } = estimate.belief.pose;
        [x, y, phi, state(&estimate).bias_variance].map(f64::to_bits)
    };
    let often = bits(1);
    for every in [2, 5, 10] {
        assert_eq!(bits(every), often, "{every}");
    }
}

#[test]
fn a_gyro_that_says_nothing_changes_no_bit() {
    let run = |gyro: Option<GyroSettings>| {
        let mut robot = robot(&Settings { gyro, ..settings() }, known());
        let mut bits = Vec::new();
        for at in 1..100 {
            let batch = [wheels(at, [0.5, 0.0, 0.3], NOISE), fix(at, [0.0; 2], 1.0)];
            let belief = tick(&mut robot, at, &batch).belief;
            bits.extend(belief.total().to_row_major().map(f64::to_bits));
            bits.push(belief.pose.phi.to_bits());
        }
        bits
    };
    assert_eq!(run(Some(GYRO)), run(None));
}

/// A fix teaches the bias, until a neighbour's word was fused.
#[test]
fn who_has_heard_a_neighbour_learns_the_bias_from_the_wheels_alone() {
    for heard in [false, true] {
        let mut robot = robot(&settings(), known());
        drive(&mut robot, 1..100, 0.1, 0.14);
        if heard {
            let pose = robot.extrapolated(ns(99 * PERIOD_NS)).belief.pose;
            let word = Measurement::Neighbour(NeighbourPose {
                stamp: ns(99 * PERIOD_NS),
                origin: Origin::counted(1),
                pose,
                parts: Parts::independent(Covariance3::diagonal([1e-2; 3]).unwrap()),
            });
            tick(&mut robot, 99, &[word]);
        }
        let before = state(&drive(&mut robot, 100..200, 0.1, 0.14));
        let seen = robot.extrapolated(ns(199 * PERIOD_NS)).belief.pose;
        let word = fix(199, [seen.x + 0.1, seen.y + 0.1], 1e-6);
        let after = state(&tick(&mut robot, 199, &[word]));
        let moved = after.bias.to_bits() != before.bias.to_bits();
        assert_eq!(moved, !heard);
        assert_eq!(after.bias_variance < before.bias_variance, !heard);
        let later = state(&drive(&mut robot, 200..210, 0.1, 0.14));
        assert!(later.bias_variance < after.bias_variance);
    }
}

/// A gyro beside wheels that both say the truth of a drive, but for their noise and for what `harm` makes of a sample.
fn harmed(
    seconds: i64,
    turn: impl Fn(f64) -> f64,
    mut harm: impl FnMut(i64, f64) -> f64,
    mut look: impl FnMut(&Estimate, f64),
) {
    const WHITE: f64 = 2e-4;
    let mut robot = robot(&settings(), known());
    let mut chance = Chance(11);
    let mut heading = 0.0;
    // Of a uniform number: √3 σ.
    let mut noise = |sigma: f64| 3.0_f64.sqrt() * sigma * chance.next();
    let mut sample = 0;
    for at in 1..=50 * seconds {
        let stands = at <= 250;
        let rate = if stands { 0.0 } else { turn(DT_S * nanos(at)) };
        let velocity = if stands { [0.0; 3] } else { [0.5, 0.0, rate] };
        let variance = if stands { [1e-10, 1e-10, 4e-6] } else { NOISE };
        let mut told = velocity;
        told[2] += noise(variance[2].sqrt());
        heading += rate * DT_S;
        let mut batch = vec![wheels(at, told, variance)];
        batch.extend(gyro(at, rate + 0.03).map(|said| {
            let Measurement::Gyro(said) = said else {
                unreachable!("a gyro's")
            };
            sample += 1;
            let rate_radps = harm(sample, said.rate_radps + noise(WHITE / 0.005_f64.sqrt()));
            Measurement::Gyro(GyroSample { rate_radps, ..said })
        }));
        look(&tick(&mut robot, at, &batch), heading);
    }
}

/// By how many σ the heading is off.
fn off(estimate: &Estimate, heading: f64) -> f64 {
    let [_, _, variance] = estimate.belief.total().variances();
    (estimate.belief.pose.phi - heading).abs() / variance.sqrt()
}

/// One of them a second, always to the same side, wherever in a tick.
#[test]
fn a_lone_wild_sample_is_neither_slip_nor_a_turn() {
    for (size, part) in [(5.0, 0), (5.0, 1), (5.0, 2), (-5.0, 3), (0.6, 1), (1e6, 3)] {
        let (mut worst, mut last, mut spikes) = (0.0_f64, None, 0);
        harmed(
            65,
            |_| 0.0,
            |sample, rate| {
                let is_spike = sample > 1000 && sample % 200 == 100 + part;
                spikes += u32::from(is_spike);
                if is_spike { rate + size } else { rate }
            },
            |estimate, heading| {
                assert_eq!(state(estimate).slipping_since, None);
                assert!(estimate.velocity[2].abs() < 0.1, "{:?}", estimate.velocity);
                worst = worst.max(off(estimate, heading));
                last = Some(*estimate);
            },
        );
        let last = last.unwrap();
        assert!(worst < 3.5, "{size} {part}: {worst} σ");
        assert!(last.belief.total().variances()[2].sqrt() < 0.03);
        assert_eq!(state(&last).wild, spikes, "{size} {part}");
        assert!((state(&last).bias - 0.03).abs() < 1e-3);
    }
}

/// In a tenth of all samples any number stands for the rate, on a slalom and on the spot.
#[test]
fn garbage_turns_nobody() {
    for (size, swing) in [(10.0, 0.0), (10.0, 1.0), (0.5, 0.0), (1e9, 1.0)] {
        let mut chance = Chance(5);
        let (mut slipping, mut ticks, mut last) = (0, 0, 0.0);
        harmed(
            65,
            |time_s| swing * libm::sin(time_s),
            |_, rate| {
                if chance.next() < -0.8 {
                    size * chance.next()
                } else {
                    rate
                }
            },
            |estimate, heading| {
                ticks += 1;
                slipping += i32::from(state(estimate).slipping_since.is_some());
                last = (estimate.belief.pose.phi - heading).abs();
            },
        );
        assert!(last < 0.05, "{size} {swing}: {last} rad");
        assert!(
            50 * slipping < ticks,
            "{size} {swing}: {slipping} of {ticks}"
        );
    }
}

/// Somebody pushes the robot, by 2 rad/s for a fifth of a second, of which its wheels know nothing: no sample of that is wild.
#[test]
fn a_push_is_no_wild_sample() {
    for begins in 0..4 {
        let pushed = move |sample: i64| (2000 + begins..2040 + begins).contains(&sample);
        let (mut heading, mut last) = (0.0, None);
        harmed(
            15,
            |_| 0.0,
            |sample, rate| {
                if pushed(sample) {
                    heading += 2.0 * 0.005;
                    rate + 2.0
                } else {
                    rate
                }
            },
            |estimate, _| last = Some(*estimate),
        );
        let last = last.unwrap();
        let error = (last.belief.pose.phi - heading).abs();
        let sigma = last.belief.total().variances()[2].sqrt();
        assert!(error < 2e-3 + 3.0 * sigma, "{begins}: {error} ± {sigma}");
    }
}
