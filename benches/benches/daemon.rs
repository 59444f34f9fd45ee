//! A whole tick of the real daemon: real frames, real shared memory, everything from the wake-up to the books.
//!
//! Only the processor time of the thread that ticks is counted, and only within the tick; messages arrive between them.
//!
//! * `hot`: tick after tick, 20 ms of the robot's time apart: what the program costs.
//! * `500 Hz`: with the wait's system calls, and with what two milliseconds leave of the caches of a shared processor. The
//!   deadline has come when the wait begins: how a thread sleeps and wakes is what `coloc latency` measures.

use std::time::{Duration, Instant};

use coloc_benches::hot::{ARRIVALS, Arrivals, Hot};
use coloc_daemon::config::Trigger;
use coloc_tests::scene::Scene;
use coloc_tests::surroundings::realtime_ns;
use criterion::{Criterion, criterion_group, criterion_main};
use rustix::time::{ClockId, clock_gettime};

/// A robot in its surroundings.
trait Case {
    fn scene(&self) -> &Scene;
    /// The next tick, after `arrive`; what it took.
    fn tick(&mut self, arrive: Arrivals) -> Duration;
}

impl Case for Hot {
    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn tick(&mut self, arrive: Arrivals) -> Duration {
        let wake = self.prepare(arrive);
        let begin = processor_time();
        self.scene.robot.wake(wake);
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
