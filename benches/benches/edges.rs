//! What comes from outside, on its way to the estimator: frames decoded, messages validated; and the rivals' fusion.

use std::error::Error;
use std::hint::black_box;

use coloc_benches::case;
use coloc_drivers::can::{BusSpec, Received};
use coloc_drivers::encoder::{OdometryConfig, OdometryDecoder, WheelFrames};
use coloc_estimator::settings::FusionSettings;
use coloc_estimator::{Parts, fusion};
use coloc_shm_types::{Clock, Header, Limits, Neighbour, Present, Reject, Sessions};
use coloc_sim::method::ellipsoidal;
use criterion::{Criterion, criterion_group, criterion_main};

const METRES_PER_TICK: f64 = 1e-4;
const PERIOD_NS: i64 = 20_000_000;

/// Both wheels' frames of a tick: identifier, length, checksum, alive counter, ticks, a velocity.
fn decode(bench: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let bus = BusSpec::Local {
        directory: "unused".into(),
    };
    let config = OdometryConfig::differential(bus, 0.3, METRES_PER_TICK, 5.0);
    let mut decoder = OdometryDecoder::new(&config)?;
    let mut wheels = WheelFrames::new(METRES_PER_TICK);
    let (mut way_m, mut stamp_ns) = (0.0, 0);
    let mut group = bench.benchmark_group("decode");
    group.bench_function("two wheels", |b| {
        b.iter(|| {
            way_m += 0.01;
            stamp_ns += PERIOD_NS;
            wheels.encode(way_m, way_m).map(|frame| {
                decoder.push(black_box(&Received {
                    frame,
                    stamp_ns,
                    bus: 0,
                }))
            })
        });
    });
    group.finish();
    Ok(())
}

/// A neighbour's message: stamp, sender, numbers, three covariances, and whether it was seen before.
fn validate(bench: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let word = case::received(0.5)?;
    let limits = Limits {
        now: Present::only(Clock::Realtime, PERIOD_NS),
        boot: 0,
        history_ns: 1_000_000_000,
        future_tolerance_ns: 0,
        own: 1,
        robots: &[1, 2, 3, 4, 5],
    };
    let parts = &word.parts;
    let mut message = Neighbour {
        header: Header {
            source: 2,
            clock: Clock::Realtime as u8,
            ..Header::default()
        },
        pose: word.pose.to_vector().into(),
        independent: parts.independent.to_row_major(),
        dependent: parts.dependent.to_row_major(),
    };
    message.validate(&limits).map_err(Reject::name)?;
    let mut sessions = Sessions::new(limits.robots.len());
    let mut group = bench.benchmark_group("validate");
    group.bench_function("neighbour", |b| {
        b.iter(|| {
            message.header.sequence += 1;
            black_box(&message).validate(&limits)?;
            sessions.accept(&message.header, PERIOD_NS)
        });
    });
    group.finish();
    Ok(())
}

/// One message, by the product and by those it is compared with.
fn rivals(bench: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let (own, received) = (case::belief()?, case::received(0.5)?);
    let mut nothing_independent = (own, received);
    nothing_independent.0.make_dependent();
    nothing_independent.1 = case::received(0.0)?;
    let mut everything = (own, case::received(1.0)?);
    everything.0.parts = Parts::independent(own.total());
    let settings = FusionSettings::paper();
    let mut group = bench.benchmark_group("one message");
    let cases = [
        ("split-ci", (own, received)),
        ("ci", nothing_independent),
        ("nb", everything),
    ];
    for (name, (own, received)) in &cases {
        group.bench_function(*name, |b| {
            b.iter(|| fusion::fuse(black_box(own), black_box(received), &settings));
        });
    }
    group.bench_function("ei", |b| {
        b.iter(|| ellipsoidal::fuse(black_box(&own), black_box(&received), settings.gate));
    });
    group.finish();
    Ok(())
}

fn edges(bench: &mut Criterion) {
    for run in [decode, validate, rivals] {
        if let Err(error) = run(bench) {
            panic!("a case of the benches is not valid: {error}");
        }
    }
}

criterion_group!(benches, edges);
criterion_main!(benches);
