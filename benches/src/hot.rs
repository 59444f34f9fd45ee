//! A robot whose ticks follow each other at once, 20 ms of its time apart: real frames, real shared memory.

use std::hint::black_box;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use coloc_daemon::clock::{KernelTime, Reading, TimeSource};
use coloc_daemon::config::{Config, GyroSource, Trigger};
use coloc_daemon::tick::Robot;
use coloc_daemon::wait::Wake;
use coloc_tests::scene::Scene;
use coloc_tests::surroundings::{Surroundings, config, realtime_ns};

/// What arrives before a tick, stamped so.
pub type Arrivals = fn(&mut Surroundings, i64);

/// What may arrive, and its name.
pub const ARRIVALS: [(&str, Arrivals); 3] = [
    ("frames", frames),
    ("4 neighbours and a fix", neighbours),
    ("and 4 sightings", sightings),
];

/// Two frames, one of each wheel.
pub fn frames(surroundings: &mut Surroundings, _: i64) {
    surroundings.send_frames([0.0; 2]);
}

/// Frames alone, which are sent one after the other.
pub fn nothing(_: &mut Surroundings, _: i64) {}

/// What four neighbours say, and a fix, before them.
pub fn words(surroundings: &mut Surroundings, stamp_ns: i64) {
    surroundings.send_what_others_know(stamp_ns, [0.0; 3]);
}

/// Two frames, what four neighbours say, and a fix.
pub fn neighbours(surroundings: &mut Surroundings, stamp_ns: i64) {
    surroundings.send_frames([0.0; 2]);
    surroundings.send_what_others_know(stamp_ns, [0.0; 3]);
}

/// The same, and four sightings.
pub fn sightings(surroundings: &mut Surroundings, stamp_ns: i64) {
    surroundings.send_frames([0.0; 2]);
    surroundings.send_messages(stamp_ns, [0.0; 3]);
}

/// Two frames, four sightings in part, the answers to those before, and a fix.
pub fn sightings_in_part(surroundings: &mut Surroundings, stamp_ns: i64) {
    surroundings.send_frames([0.0; 2]);
    surroundings.send_sightings_in_part(stamp_ns);
}

/// As many of both, seen by range and bearing alone, and the answers to the sightings of the tick before.
pub fn parts(surroundings: &mut Surroundings, stamp_ns: i64) {
    surroundings.send_frames([0.0; 2]);
    surroundings.send_parts(stamp_ns);
}

/// [`frames`], a gyro at 200 Hz and a heading at 10 Hz.
pub fn turning_frames(surroundings: &mut Surroundings, stamp_ns: i64) {
    frames(surroundings, stamp_ns);
    turn(surroundings, stamp_ns);
}

/// [`neighbours`], a gyro at 200 Hz and a heading at 10 Hz.
pub fn turning_neighbours(surroundings: &mut Surroundings, stamp_ns: i64) {
    neighbours(surroundings, stamp_ns);
    turn(surroundings, stamp_ns);
}

fn turn(surroundings: &mut Surroundings, stamp_ns: i64) {
    let before = surroundings.send_turns(stamp_ns);
    if before.is_multiple_of(20) {
        surroundings.send_heading(stamp_ns);
    }
}

/// A line of the caches \[bytes\], and what others have meanwhile: several times what the largest cache holds that is counted with.
const LINE: usize = 64;
const OTHERS: usize = 4 * CACHE;
/// The largest cache that is counted with \[bytes\]: a tick fits into it several times.
pub const CACHE: usize = 1 << 20;

/// So that nothing else is in the caches.
fn read_all(others: &[u8]) {
    for byte in others.iter().step_by(LINE) {
        black_box(*byte);
    }
}

/// A tick, by a name of its own.
#[inline(never)]
pub fn after_the_last_frame(robot: &mut Robot) {
    black_box(robot.wake(Wake::Frame));
}

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

/// The robot, what surrounds it, and its clock.
pub struct Hot {
    /// The robot in its surroundings.
    pub scene: Scene,
    clock: Hurried,
}

impl Hot {
    /// Before its first tick.
    ///
    /// # Errors
    /// Of the temporary directory.
    pub fn new() -> io::Result<Self> {
        Self::of(|_| ())
    }

    /// The same, of a robot with a gyro.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_gyro(source: GyroSource) -> io::Result<Self> {
        Self::of(|config| config.gyro.source = source)
    }

    /// The same, of a robot that takes part in the exchange of what is seen in part.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn in_part() -> io::Result<Self> {
        Self::of(|config| config.sighting.heard = true)
    }

    /// The same, open to this group.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn open_to(group: String) -> io::Result<Self> {
        Self::of(|config| config.shm.group = group)
    }

    fn of(differs: impl FnOnce(&mut Config)) -> io::Result<Self> {
        let (directory, clock) = (tempfile::tempdir()?, Hurried::default());
        let mut config = config(directory.path(), Trigger::Timer);
        config.history.length_s = 1.0;
        differs(&mut config);
        let scene = Scene::with(directory, config, Box::new(clock.clone()));
        Ok(Self { scene, clock })
    }

    /// The next tick is due: `arrive`, and what the robot said before is read. When it was due.
    pub fn prepare(&mut self, arrive: Arrivals) -> Wake {
        self.clock.skip(PERIOD_NS);
        let stamp_ns = realtime_ns() + self.clock.skipped_ns();
        arrive(&mut self.scene.surroundings, stamp_ns);
        let _ = self.scene.surroundings.receive();
        Wake::Deadline {
            deadline_ns: self.clock.now_ns(),
            missed: 0,
        }
    }

    /// `ticks` of them.
    pub fn run(&mut self, arrive: Arrivals, ticks: u64) {
        for _ in 0..ticks {
            let wake = self.prepare(arrive);
            self.scene.robot.wake(wake);
        }
    }

    /// The same, and nothing that a tick needs is left in the caches at its begin.
    pub fn run_cold(&mut self, arrive: Arrivals, ticks: u64) {
        let others = vec![1_u8; OTHERS];
        for _ in 0..ticks {
            let wake = self.prepare(arrive);
            read_all(&others);
            self.scene.robot.wake(wake);
        }
    }

    /// Cold ticks whose frames come one after the other, after `messages`: what there is to do once the last one is there is
    /// [`after_the_last_frame`], rehearsed if `rehearsed`.
    pub fn run_apart(&mut self, messages: Arrivals, ticks: u64, rehearsed: bool) {
        let others = vec![1_u8; OTHERS];
        for _ in 0..ticks {
            self.clock.skip(PERIOD_NS / 2);
            let _ = self.scene.surroundings.receive();
            messages(
                &mut self.scene.surroundings,
                realtime_ns() + self.clock.skipped_ns(),
            );
            let [left, right] = self.scene.surroundings.frames([0.0; 2]);
            read_all(&others);
            self.scene.surroundings.send_frame(&left);
            self.scene.robot.wake(Wake::Frame);
            if rehearsed {
                self.scene.robot.prepare();
            }
            self.clock.skip(PERIOD_NS / 2);
            self.scene.surroundings.send_frame(&right);
            after_the_last_frame(&mut self.scene.robot);
        }
    }

    /// Ticks until everybody is connected.
    pub fn warm(&mut self, arrive: Arrivals) {
        while !self.scene.is_warm() {
            self.run(arrive, 1);
        }
    }
}
