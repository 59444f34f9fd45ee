//! A whole `step`: odometry, a fix, and what 0 to 64 neighbours say; and a measurement that comes late.

use coloc_benches::case;
use coloc_benches::robot::Robot;
use coloc_estimator::NotACovariance;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

fn whole_tick(bench: &mut Criterion) -> Result<(), NotACovariance> {
    let mut group = bench.benchmark_group("tick");
    for neighbours in [0_u16, 1, 4, 16, 64] {
        let mut robot = Robot::warm(usize::from(neighbours))?;
        group.throughput(Throughput::Elements(u64::from(neighbours) + 1));
        group.bench_function(BenchmarkId::new("neighbours", neighbours), |b| {
            b.iter(|| robot.tick_hearing(usize::from(neighbours)));
        });
    }
    let mut robot = Robot::warm(4)?;
    let (_, covariance) = case::fix()?;
    group.throughput(Throughput::Elements(6));
    group.bench_function("4 neighbours and a fix", |b| {
        b.iter(|| robot.tick_with_fix(4, covariance));
    });
    group.finish();
    Ok(())
}

/// One message, stamped so many ticks ago: everything since is applied again.
fn put_back(bench: &mut Criterion) -> Result<(), NotACovariance> {
    let mut group = bench.benchmark_group("late by");
    for ticks in [1_i64, 10, 50] {
        let mut robot = Robot::warm(0)?;
        group.bench_function(BenchmarkId::new("ticks", ticks), |b| {
            b.iter(|| robot.tick_late(ticks));
        });
    }
    group.finish();
    Ok(())
}

fn tick(bench: &mut Criterion) {
    for run in [whole_tick, put_back] {
        if let Err(error) = run(bench) {
            panic!("a case of the benches is not valid: {error}");
        }
    }
}

criterion_group!(benches, tick);
criterion_main!(benches);
