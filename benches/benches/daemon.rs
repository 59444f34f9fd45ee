//! A whole tick of the real daemon: real frames, real shared memory, everything from the wake-up to the books.
//!
//! Only the processor time of the thread that ticks is counted, and only within the tick; messages arrive between them.
//!
//! * `hot`: tick after tick, 20 ms of the robot's time apart: what the program costs.
//! * `500 Hz`: with the wait's system calls, and with what two milliseconds leave of the caches of a shared processor. The
//!   deadline has come when the wait begins: how a thread sleeps and wakes is what `coloc latency` measures.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, Instant};

use coloc_daemon::clock::{KernelTime, Reading, TimeSource};
use coloc_daemon::config::Trigger;
use coloc_daemon::wait::Wake;
use coloc_tests::scene::Scene;
use coloc_tests::surroundings::{Surroundings, config, realtime_ns};
use criterion::{Criterion, criterion_group, criterion_main};
use rustix::time::{ClockId, clock_gettime};

/// What arrives before a tick, stamped so.
type Arrivals = fn(&mut Surroundings, i64);

const ARRIVALS: [(&str, Arrivals); 3] = [
    ("frames", |surroundings, _| {
        surroundings.send_frames([0.0; 2]);
    }),
    ("4 neighbours and a fix", |surroundings, stamp_ns| {
        surroundings.send_frames([0.0; 2]);
        surroundings.send_what_others_know(stamp_ns, [0.0; 3]);
    }),
    ("and 4 sightings", |surroundings, stamp_ns| {
        surroundings.send_frames([0.0; 2]);
        surroundings.send_messages(stamp_ns, [0.0; 3]);
    }),
];

/// From tick to tick of a robot in a hurry.
const PERIOD_NS: i64 = 20_000_000;

/// The kernel's clocks, and what was skipped.
#[derive(Clone, Default)]
struct Hurried(Arc<AtomicI64>);

impl Hurried {
    fn skip(&self, ns: i64) {
        self.0.fetch_add(ns, Ordering::Relaxed);
    }

    fn skipped_ns(&self) -> i64 {
        self.0.load(Ordering::Relaxed)
    }
}

impl TimeSource for Hurried {
    fn read(&self) -> Reading {
        let (now, skipped_ns) = (KernelTime.read(), self.skipped_ns());
        Reading {
            boot_ns: now.boot_ns + skipped_ns,
            realtime_ns: now.realtime_ns + skipped_ns,
            tai_ns: now.tai_ns + skipped_ns,
            width_ns: now.width_ns,
        }
    }

    fn now_ns(&self) -> i64 {
        KernelTime.now_ns() + self.skipped_ns()
    }
}

/// A robot in its surroundings.
trait Case {
    fn scene(&self) -> &Scene;
    /// The next tick, after `arrive`; what it took.
    fn tick(&mut self, arrive: Arrivals) -> Duration;
}

struct Hot {
    scene: Scene,
    clock: Hurried,
}

impl Hot {
    fn new() -> std::io::Result<Self> {
        let (directory, clock) = (tempfile::tempdir()?, Hurried::default());
        let mut config = config(directory.path(), Trigger::Timer);
        config.history.length_s = 1.0;
        let scene = Scene::with(directory, config, Box::new(clock.clone()));
        Ok(Self { scene, clock })
    }
}

impl Case for Hot {
    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn tick(&mut self, arrive: Arrivals) -> Duration {
        self.clock.skip(PERIOD_NS);
        let stamp_ns = realtime_ns() + self.clock.skipped_ns();
        arrive(&mut self.scene.surroundings, stamp_ns);
        let _ = self.scene.surroundings.receive();
        let deadline_ns = self.clock.now_ns();
        let begin = processor_time();
        self.scene.robot.wake(Wake::Deadline {
            deadline_ns,
            missed: 0,
        });
        processor_time().saturating_sub(begin)
    }
}

struct Paced(Scene);

impl Case for Paced {
    fn scene(&self) -> &Scene {
        &self.0
    }

    fn tick(&mut self, arrive: Arrivals) -> Duration {
        let before = Instant::now();
        arrive(&mut self.0.surroundings, realtime_ns());
        let _ = self.0.surroundings.receive();
        while before.elapsed() < self.0.period() {}
        let begin = processor_time();
        self.0.turn();
        processor_time().saturating_sub(begin)
    }
}

/// Of this thread.
fn processor_time() -> Duration {
    Duration::try_from(clock_gettime(ClockId::ThreadCPUTime)).unwrap_or_default()
}

fn whole_tick(bench: &mut Criterion) {
    for (name, arrive) in ARRIVALS {
        match Hot::new() {
            Ok(hot) => measure(bench, "daemon, hot", name, arrive, hot),
            Err(error) => panic!("no temporary directory: {error}"),
        }
        let paced = Paced(Scene::new(Trigger::Timer));
        measure(bench, "daemon, 500 Hz", name, arrive, paced);
    }
}

fn measure(bench: &mut Criterion, group: &str, name: &str, arrive: Arrivals, mut case: impl Case) {
    while !case.scene().is_warm() {
        case.tick(arrive);
    }
    let mut group = bench.benchmark_group(group);
    group.bench_function(name, |b| {
        b.iter_custom(|ticks| (0..ticks).map(|_| case.tick(arrive)).sum());
    });
    group.finish();
}

criterion_group!(benches, whole_tick);
criterion_main!(benches);
