//! The estimator's functions beside their floor and their naive version.

use std::hint::black_box;

use coloc_benches::naive::Split;
use coloc_benches::{case, floor, naive};
use coloc_estimator::convert::{self, GlobalPose};
use coloc_estimator::settings::{Criterion, FusionSettings};
use coloc_estimator::{Belief, NotACovariance, Propagation, fix, fusion, propagate};
use criterion::{Criterion as Bench, criterion_group, criterion_main};
use nalgebra::{DMatrix, DVector};

const DT_S: f64 = 0.02;
/// Of the heading before, and of the noise of a turn.
const VARIANCES: [f64; 2] = [1e-3, 1.4e-4];

fn split(pose: coloc_estimator::Pose, total: &[f64; 9], independent: &[f64; 9]) -> Split {
    Split {
        mean: DVector::from_vec(vec![pose.x, pose.y, pose.phi]),
        total: DMatrix::from_row_slice(3, 3, total),
        independent: DMatrix::from_row_slice(3, 3, independent),
    }
}

fn split_of(belief: &Belief) -> Split {
    split(
        belief.pose,
        &belief.total().to_row_major(),
        &belief.parts.independent.to_row_major(),
    )
}

fn split_of_message(message: &GlobalPose) -> Split {
    split(
        message.pose,
        &message.total().to_row_major(),
        &message.parts.independent.to_row_major(),
    )
}

fn bench_propagate(bench: &mut Bench) -> Result<(), NotACovariance> {
    let (belief, motion) = (case::belief()?, case::motion());
    let own = split_of(&belief);
    let velocity = DVector::from_vec(vec![0.36, 0.2]);
    let noise = DMatrix::from_row_slice(2, 2, &[5.075 * 0.36 * 0.36, 0.0, 0.0, 0.345]);
    let mut group = bench.benchmark_group("propagate");
    group.bench_function("coloc", |b| {
        b.iter(|| {
            propagate(
                black_box(&belief),
                black_box(&motion),
                DT_S,
                Propagation::Honest,
            )
        });
    });
    group.bench_function("floor", |b| {
        b.iter(|| floor::propagate(black_box(-2.2), black_box(VARIANCES)));
    });
    group.bench_function("naive", |b| {
        b.iter(|| {
            naive::propagate(
                black_box(&own.mean),
                &own.total,
                &own.independent,
                &velocity,
                &noise,
                DT_S,
            )
        });
    });
    group.finish();
    Ok(())
}

fn bench_convert(bench: &mut Bench) -> Result<(), NotACovariance> {
    let (belief, (relative, covariance)) = (case::belief()?, case::sighting()?);
    let own = split_of(&belief);
    let seen = DVector::from_vec(vec![relative.x, relative.y, relative.phi]);
    let noise = DMatrix::from_row_slice(3, 3, &covariance.to_row_major());
    let mut group = bench.benchmark_group("convert");
    group.bench_function("coloc", |b| {
        b.iter(|| {
            convert::to_global(
                black_box(&belief),
                black_box(&relative),
                black_box(&covariance),
                Propagation::Honest,
            )
        });
    });
    group.bench_function("floor", |b| {
        b.iter(|| floor::propagate(black_box(-2.2), black_box(VARIANCES)));
    });
    group.bench_function("naive", |b| {
        b.iter(|| {
            naive::convert(
                black_box(&own.mean),
                &own.total,
                &own.independent,
                &seen,
                &noise,
            )
        });
    });
    group.finish();
    Ok(())
}

/// α in the middle, at the receiver's end (nothing new in the message) and at the sender's.
fn bench_split_ci(bench: &mut Bench) -> Result<(), NotACovariance> {
    let regular = case::belief()?;
    let mut shared = regular;
    shared.make_dependent();
    let cases = [
        ("middle", regular, case::received(0.5)?),
        ("own all dependent", shared, case::received(0.5)?),
        ("message all dependent", regular, case::received(0.0)?),
        (
            "own all independent",
            Belief::independent(regular.pose, regular.total()),
            case::received(0.5)?,
        ),
        ("message all independent", regular, case::received(1.0)?),
    ];
    for (criterion, name) in [
        (Criterion::Trace, "trace"),
        (Criterion::Determinant, "determinant"),
    ] {
        let settings = FusionSettings {
            criterion,
            ..FusionSettings::default()
        };
        let mut group = bench.benchmark_group(format!("split-ci {name}"));
        for (case, own, message) in &cases {
            group.bench_function(format!("coloc, {case}"), |b| {
                b.iter(|| fusion::fuse(black_box(own), black_box(message), &settings));
            });
        }
        if criterion == Criterion::Trace {
            let (own, message) = (split_of(&regular), split_of_message(&cases[0].2));
            group.bench_function("naive", |b| {
                b.iter(|| naive::split_ci(black_box(&own), black_box(&message), settings.gate));
            });
        }
        group.finish();
    }
    Ok(())
}

fn bench_fix(bench: &mut Bench) -> Result<(), NotACovariance> {
    let (belief, (position, covariance)) = (case::belief()?, case::fix()?);
    let own = split_of(&belief);
    let (at, noise) = (
        DVector::from_vec(position.to_vec()),
        DMatrix::from_row_slice(2, 2, &[0.01, 0.0, 0.0, 0.01]),
    );
    let gate = coloc_estimator::gate::CHI2_2_99;
    let mut group = bench.benchmark_group("position fix");
    group.bench_function("coloc", |b| {
        b.iter(|| {
            fix::update(
                black_box(&belief),
                black_box(position),
                black_box(&covariance),
                gate,
            )
        });
    });
    group.bench_function("gated out", |b| {
        b.iter(|| {
            fix::update(
                black_box(&belief),
                black_box([9.0, 9.0]),
                black_box(&covariance),
                gate,
            )
        });
    });
    group.bench_function("naive", |b| {
        b.iter(|| naive::fix(black_box(&own), &at, &noise, gate));
    });
    group.finish();
    Ok(())
}

fn kernels(bench: &mut Bench) {
    for run in [bench_propagate, bench_convert, bench_split_ci, bench_fix] {
        if let Err(error) = run(bench) {
            panic!("a case of the benches is not valid: {error}");
        }
    }
}

criterion_group!(benches, kernels);
criterion_main!(benches);
