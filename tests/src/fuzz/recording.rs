//! Recordings: whatever is missing or spoiled, what is read can be replayed.

use coloc_daemon::record::{Known, Record, Recording, Step};
use coloc_estimator::{Estimator, Settings, Slot, step};

use super::{Target, scratch};

pub(super) const TARGET: Target = Target {
    name: "recording",
    run,
    samples,
};

fn run(bytes: &[u8]) {
    let path = scratch::file("record", bytes);
    let Ok(recording) = Recording::read(&path) else {
        return;
    };
    let slots = [Slot::default(); 16];
    let settings = Settings::default();
    let mut robot = Estimator::starting(settings, recording.stamp, &recording.start, slots);
    for tick in &recording.ticks {
        let _ = step(&mut robot, &tick.inputs());
    }
}

fn samples() -> Vec<Vec<u8>> {
    let unit = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let begin = Record::Begin {
        gyro: Some([0.02, 1e-6]),
        robot: 1,
        stamp_ns: 0,
        known: Known::Pose,
        pose: [0.0; 3],
        independent: unit,
        dependent: unit,
        bend: [0.0; 6],
    };
    let tick = |tick: u64, inputs| Record::Tick {
        tick,
        stamp_ns: 20_000_000 * (tick.cast_signed() + 1),
        inputs,
        step: Step::Own,
    };
    let moved = |stamp_ns| Record::Odometry {
        source: 0,
        start_ns: stamp_ns - 20_000_000,
        stamp_ns,
        holonomic: false,
        velocity: [0.5, 0.0, 0.1],
        noise: unit,
    };
    let fix = Record::Fix {
        stamp_ns: 15_000_000,
        source: 1,
        session: 5,
        sequence: 1,
        position: [0.1, 0.2],
        covariance: [1.0, 0.0, 0.0, 1.0],
        slow_variance: 1.0,
        slow_memory_ns: 60_000_000_000,
        lever: [0.3, 0.0],
    };
    let looking = Record::Heading {
        stamp_ns: 16_000_000,
        source: 2,
        session: 5,
        sequence: 1,
        heading: 0.1,
        variance: 0.01,
        slow_variance: 0.0,
        slow_memory_ns: 0,
        least_m_s: Some(0.5),
        lever: [0.3, 0.0],
    };
    let said = |stamp_ns| Record::Estimate {
        stamp_ns,
        pose: [0.0, 0.1, 0.0],
        independent: unit,
        dependent: unit,
        bend: [0.0; 6],
        opinion: 0,
    };
    let first = [
        begin,
        tick(0, 3),
        moved(20_000_000),
        fix,
        looking,
        said(20_000_000),
    ];
    let rest = [
        Record::Lost { lines: 2 },
        tick(2, 1),
        moved(60_000_000),
        said(60_000_000),
    ];
    let lines = first.iter().chain(&rest);
    let lines = lines.map(|record| serde_json::to_string(record).unwrap() + "\n");
    vec![lines.collect::<String>().into()]
}
