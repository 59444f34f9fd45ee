//! Lets a robot live through days in minutes and holds it to this: nothing grows, drifts or runs out.
//!
//! It is a real robot, under a clock that runs a period ahead with each tick: two encoder frames a tick; four sightings, a
//! fix and four neighbours' poses each fifth one; telemetry on its thread. It drives in a circle without rest. All that it
//! is told is true, so it must not stray; the counts of its encoders wrap after some 40 hours.
#![allow(
    clippy::unwrap_used,
    reason = "what fails here fails the run, and the panic says where"
)]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod footprint;
mod watch;
mod way;

use std::process::ExitCode;
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::{Parser, value_parser};
use coloc_counting::{Calls, calls_during};
use coloc_daemon::clock::TimeSource;
use coloc_daemon::config::Trigger;
use coloc_daemon::wait::Wake;
use coloc_shm_types::Input;
use coloc_tests::output::{check_place, end, print_line};
use coloc_tests::rig::{Clock, PERIOD_NS, Stamps};
use coloc_tests::scene::{Scene, WARM_UP};
use coloc_tests::surroundings::{Heard, config};

use footprint::Footprint;
use watch::Watch;

/// Lets a robot live through days in minutes: nothing may grow, drift or run out.
#[derive(Parser)]
struct Args {
    /// How many ticks, 20 ms of the robot's time each.
    #[arg(long, default_value_t = 10_000_000, value_parser = value_parser!(u64).range(1000..))]
    ticks: u64,
}

/// Looks at the process after the first one.
const POINTS: u64 = 10;
/// Before the first look: by then all stacks and all blocks of the allocators have been touched.
const LONGEST_WARM_UP: u64 = 100_000;
/// By everybody's clock: by then telemetry has made its first rounds, and has all the memory that these take.
const SHORTEST_WARM_UP: Duration = Duration::from_secs(5);
/// Messages come at 10 Hz.
const TICKS_PER_MESSAGE: u64 = 5;
/// By which memory may grow after the first look \[KiB\].
const TOLERANCE_KIB: u64 = 64;

fn main() -> ExitCode {
    let Args { ticks } = Args::parse();
    let result = check_place().map(|()| live(ticks));
    end(
        "endurance",
        result.map(|()| ExitCode::SUCCESS).map_err(Into::into),
    )
}

fn live(ticks: u64) {
    let warm_up = (ticks / 2).min(LONGEST_WARM_UP);
    let mut life = Life::new();
    life.scene().with_telemetry(|scene| {
        life.run_until(warm_up, scene);
        sleep(SHORTEST_WARM_UP.saturating_sub(life.begun.elapsed()));
        for point in 0..=POINTS {
            life.run_until(warm_up + (ticks - warm_up) * point / POINTS, scene);
            life.look(scene);
        }
    });
    print_line(&format!("{ticks} ticks: nothing grew, nothing was lost"));
}

/// What the run knows beside the scene.
struct Life {
    clock: Clock,
    begun: Instant,
    ticks: u64,
    watch: Watch,
    heard: Heard,
    first: Option<Footprint>,
}

impl Life {
    fn new() -> Self {
        print_line(&format!(
            "{:>10} {:>7} {:>7} {:>10} {:>11} {:>5} {:>10} {:>8} {:>8}",
            "ticks",
            "hours",
            "wall s",
            "memory KiB",
            "descriptors",
            "files",
            "accepted",
            "off m",
            "σ m"
        ));
        Self {
            clock: Clock::new(Stamps::Plausible),
            begun: Instant::now(),
            ticks: 0,
            watch: Watch::default(),
            heard: Heard::default(),
            first: None,
        }
    }

    fn scene(&self) -> Scene {
        let directory = tempfile::tempdir().unwrap();
        let mut config = config(directory.path(), Trigger::Timer);
        config.tick.rate_hz = 50.0;
        config.history.length_s = 1.0;
        Scene::with(directory, config, Box::new(self.clock.clone()))
    }

    fn run_until(&mut self, ticks: u64, scene: &mut Scene) {
        while self.ticks < ticks {
            self.tick(scene);
        }
    }

    fn tick(&mut self, scene: &mut Scene) {
        let time_s = self.time_s();
        self.clock.run(PERIOD_NS);
        let truth = way::pose(time_s);
        scene.surroundings.send_frames(way::wheels_m(time_s));
        if self.ticks.is_multiple_of(TICKS_PER_MESSAGE) {
            scene
                .surroundings
                .send_messages(self.clock.read().realtime_ns, truth);
        }
        let wake = Wake::Deadline {
            deadline_ns: self.clock.now_ns(),
            missed: 0,
        };
        let (_, calls) = calls_during(|| scene.robot.wake(wake));
        assert!(
            calls == Calls::NONE || self.ticks < WARM_UP,
            "tick {}: {calls:?}",
            self.ticks
        );
        self.ticks += 1;
        let estimate = scene.surroundings.estimates.receive().unwrap();
        self.watch.look(&estimate.expect("a tick publishes"), truth);
        self.heard += scene.surroundings.receive();
    }

    #[allow(clippy::cast_precision_loss, reason = "ticks are fewer than 2⁵³")]
    fn time_s(&self) -> f64 {
        self.ticks as f64 * PERIOD_NS as f64 * 1e-9
    }

    /// Prints how it is doing, and fails if that is not well.
    fn look(&mut self, scene: &Scene) {
        let _ = Footprint::now(&scene.config.shm.root); // What looking takes is taken now.
        let now = Footprint::now(&scene.config.shm.root);
        let status = scene.robot.account().status();
        print_line(&format!(
            "{:>10} {:>7.2} {:>7.1} {:>10} {:>11} {:>5} {:>10} {:>8.4} {:>8.4}",
            self.ticks,
            self.time_s() / 3600.0,
            self.begun.elapsed().as_secs_f64(),
            now.own_kib,
            now.descriptors,
            now.files,
            status.accepted.iter().sum::<u64>(),
            self.watch.error_m,
            self.watch.sigma_m,
        ));
        self.watch.begin_again();
        let first = *self.first.get_or_insert(now);
        assert!(
            now.own_kib <= first.own_kib + TOLERANCE_KIB,
            "memory has grown by more than {TOLERANCE_KIB} KiB"
        );
        assert_eq!(
            (now.descriptors, now.files),
            (first.descriptors, first.files),
            "descriptors, files"
        );
        self.check_books(scene);
    }

    /// Everything that was sent was taken in, and everything that follows from it was said.
    fn check_books(&self, scene: &Scene) {
        let status = scene.robot.account().status();
        let messages = self.ticks.div_ceil(TICKS_PER_MESSAGE);
        // The first frames only say where counting starts.
        for (input, sent) in [
            (Input::Odometry, self.ticks - 1),
            (Input::RelativePose, 4 * messages),
            (Input::Position, messages),
            (Input::Neighbour, 4 * messages),
        ] {
            assert_eq!(
                (status.accepted_of(input), status.rejected_total(input)),
                (sent, 0),
                "{input}, accepted and rejected: {status:?}"
            );
        }
        assert_eq!((status.tick, status.losses.events), (self.ticks, 0));
        assert_eq!(self.heard.poses, 4 * messages, "poses told to neighbours");
    }
}
