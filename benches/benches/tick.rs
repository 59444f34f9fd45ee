//! A whole `step`: odometry, a fix, and what 0 to 64 neighbours say; and a measurement that comes late.
//!
//! The estimator lives through the bench as it does on a robot: each iteration is the next tick, on a full history.

use std::hint::black_box;

use coloc_benches::case;
use coloc_estimator::convert::GlobalPose;
use coloc_estimator::history::Slot;
use coloc_estimator::{
    Estimator, NeighbourPose, NotACovariance, OdometrySample, PositionFix, RobotId, Settings, Span,
    Stamp, TickInputs, step,
};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

const PERIOD: Span = Span::from_millis(20);
const SLOTS: usize = 8192;

/// A robot with its senders, one tick after the other.
struct Robot {
    estimator: Estimator<Vec<Slot>>,
    now: Stamp,
    sequence: u64,
    word: GlobalPose,
}

impl Robot {
    fn new() -> Result<Self, NotACovariance> {
        let mut settings = Settings::default();
        // Every message is worth its cost: none is gated out, whatever the robot has come to believe.
        settings.fusion.gate = f64::INFINITY;
        settings.position_gate = f64::INFINITY;
        let start = Stamp::from_nanos(1_000_000_000);
        Ok(Self {
            estimator: Estimator::new(
                settings,
                start,
                case::belief()?,
                vec![Slot::default(); SLOTS],
            ),
            now: start,
            sequence: 0,
            word: case::received(0.5)?,
        })
    }

    fn neighbour(&mut self, sender: u16, stamp: Stamp) -> NeighbourPose {
        self.sequence += 1;
        NeighbourPose {
            stamp,
            sequence: self.sequence,
            sender: RobotId(sender),
            pose: self.word.pose,
            total: self.word.total,
            independent: self.word.independent,
        }
    }

    /// The next tick, with `neighbours` and `fixes`.
    fn tick(&mut self, neighbours: &[NeighbourPose], fixes: &[PositionFix]) -> f64 {
        let start = self.now;
        self.now = self.now + PERIOD;
        let odometry = [OdometrySample {
            start,
            stamp: self.now,
            motion: case::motion(),
        }];
        let inputs = TickInputs {
            stamp: self.now,
            odometry: &odometry,
            sightings: &[],
            neighbours,
            fixes,
        };
        step(&mut self.estimator, black_box(&inputs))
            .estimate
            .belief
            .pose
            .x
    }

    /// A second of driving, so that the history is as full as it gets.
    fn warm_up(&mut self, neighbours: u16) {
        for _ in 0..60 {
            self.tick_hearing(neighbours);
        }
    }

    fn tick_hearing(&mut self, neighbours: u16) -> f64 {
        let stamp = self.now + PERIOD;
        let said: [NeighbourPose; 64] =
            std::array::from_fn(|sender| self.neighbour(u16::try_from(sender).unwrap_or(0), stamp));
        let heard = said.get(..usize::from(neighbours)).unwrap_or(&said);
        self.tick(heard, &[])
    }
}

fn whole_tick(bench: &mut Criterion) -> Result<(), NotACovariance> {
    let mut group = bench.benchmark_group("tick");
    for neighbours in [0_u16, 1, 4, 16, 64] {
        let mut robot = Robot::new()?;
        robot.warm_up(neighbours);
        group.throughput(Throughput::Elements(u64::from(neighbours) + 1));
        group.bench_function(BenchmarkId::new("neighbours", neighbours), |b| {
            b.iter(|| robot.tick_hearing(neighbours));
        });
    }
    group.finish();
    Ok(())
}

fn with_a_fix(bench: &mut Criterion) -> Result<(), NotACovariance> {
    let mut robot = Robot::new()?;
    robot.warm_up(4);
    let (position, covariance) = case::fix()?;
    bench.bench_function("tick/4 neighbours and a fix", |b| {
        b.iter(|| {
            let stamp = robot.now + PERIOD;
            let said: [NeighbourPose; 4] = std::array::from_fn(|sender| {
                robot.neighbour(u16::try_from(sender).unwrap_or(0), stamp)
            });
            let sequence = robot.sequence;
            let fix = PositionFix {
                stamp,
                sequence,
                position,
                covariance,
            };
            robot.tick(&said, &[fix])
        });
    });
    Ok(())
}

/// One message, stamped so many ticks ago: everything since is applied again.
fn put_back(bench: &mut Criterion) -> Result<(), NotACovariance> {
    let mut group = bench.benchmark_group("late by");
    for ticks in [1_i64, 10, 50] {
        let mut robot = Robot::new()?;
        robot.warm_up(0);
        let delay = Span::from_nanos(PERIOD.as_nanos() * ticks);
        group.bench_function(BenchmarkId::new("ticks", ticks), |b| {
            b.iter(|| {
                let measured = robot.now + PERIOD - delay;
                let late = robot.neighbour(1, measured);
                robot.tick(&[late], &[])
            });
        });
    }
    group.finish();
    Ok(())
}

fn tick(bench: &mut Criterion) {
    for run in [whole_tick, with_a_fix, put_back] {
        if let Err(error) = run(bench) {
            panic!("a case of the benches is not valid: {error}");
        }
    }
}

criterion_group!(benches, tick);
criterion_main!(benches);
