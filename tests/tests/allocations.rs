//! The real-time thread asks nothing of the allocator: counted over ten thousand real ticks with all inputs arriving.
//!
//! Between the ticks the same thread plays the surroundings, which is not counted. Counting starts after a warm-up: the
//! first message over a new connection maps its shared memory.
#![allow(
    clippy::unwrap_used,
    reason = "a test fails by panicking, also in its helpers"
)]

use std::sync::Arc;
use std::sync::mpsc::channel;

use coloc_counting::{Calls, calls_during};
use coloc_daemon::clock::{KernelTime, TimeSource};
use coloc_daemon::config::{Realtime, Scheduler};
use coloc_daemon::event::Link;
use coloc_daemon::realtime;
use coloc_daemon::telemetry::Telemetry;
use coloc_daemon::tick::{Outcome, Robot};
use coloc_daemon::wait::{Wait, Wake};
use coloc_shm_types::{Input, Space};
use coloc_tests::surroundings::{Heard, Surroundings, config};
use rustix::event::{EventfdFlags, eventfd};

#[test]
fn no_tick_on_the_timer_allocates() {
    ticks_without_allocation("timer", 10_000);
}

#[test]
fn no_tick_on_a_frame_allocates() {
    ticks_without_allocation("encoder", 10_000);
}

const WARM_UP: u64 = 200;

fn ticks_without_allocation(trigger: &str, ticks: u64) {
    let directory = tempfile::tempdir().unwrap();
    let config = config(directory.path(), trigger);
    let space = Space::open(&config.shm.root, &config.shm.prefix, "test").unwrap();
    let mut surroundings = Surroundings::new(directory.path(), &space);
    let link = Arc::new(Link::new());
    let mut robot = Robot::open(&config, &space, Box::new(KernelTime), Arc::clone(&link)).unwrap();
    let stop = eventfd(0, EventfdFlags::CLOEXEC).unwrap();
    let mut wait = Wait::new(
        config.tick.trigger,
        config.period_ns(),
        KernelTime.monotonic_ns(),
        stop,
    )
    .unwrap();
    robot
        .collect()
        .buses()
        .for_each(|bus| wait.watch(bus).unwrap());

    let (mut calls, mut heard, mut counted) = (Calls::NONE, Heard::default(), 0);
    let telemetry = || {
        let space = Space::open(&config.shm.root, &config.shm.prefix, "telemetry").unwrap();
        Telemetry::open(&config, &space, Arc::clone(&link)).unwrap()
    };
    std::thread::scope(|threads| {
        // The other end of the ring: without it the ring would be full, and the way into it not exercised.
        let (running, stopped) = channel();
        threads.spawn(move || telemetry().run(&stopped));
        while counted < ticks {
            surroundings.send();
            let (ticked, during) = calls_during(|| one_tick(&mut robot, &mut wait));
            let received = surroundings.receive();
            if robot.account().status.tick > WARM_UP {
                calls += during;
                counted += u64::from(ticked);
                heard += received;
            }
        }
        drop(running);
    });

    assert_eq!(calls, Calls::NONE, "over {counted} ticks");
    let status = robot.account().status;
    for input in Input::ALL {
        // Of frames that a late tick brought close together the wheels make one sample.
        let at_least = if input == Input::Odometry {
            ticks / 2
        } else {
            ticks
        };
        let accepted = status.accepted_of(input);
        assert!(
            accepted >= at_least,
            "{input}: {accepted} in {ticks} ticks; {status:?}"
        );
    }
    assert!(
        heard.estimates >= ticks && heard.poses >= 4 * ticks,
        "{heard:?}"
    );
}

/// Memory as the daemon sets it up: locked, the stack touched. Faults of the thread that ticks, everything it plays
/// between the ticks included.
#[test]
fn no_tick_faults_on_a_page() {
    let directory = tempfile::tempdir().unwrap();
    let config = config(directory.path(), "timer");
    let space = Space::open(&config.shm.root, &config.shm.prefix, "test").unwrap();
    let mut surroundings = Surroundings::new(directory.path(), &space);
    let link = Arc::new(Link::new());
    let mut robot = Robot::open(&config, &space, Box::new(KernelTime), link).unwrap();
    let memory = Realtime {
        scheduler: Scheduler::Other,
        ..config.realtime.clone()
    };
    let refused = realtime::set_up(&memory);
    if let Some(refused) = refused.first() {
        eprintln!("SKIPPED: page faults on the real-time thread: {refused}");
        return;
    }
    let stop = eventfd(0, EventfdFlags::CLOEXEC).unwrap();
    let now_ns = KernelTime.monotonic_ns();
    let mut wait = Wait::new(config.tick.trigger, config.period_ns(), now_ns, stop).unwrap();
    let mut faults = 0;
    while robot.account().status.tick < 2000 {
        surroundings.send();
        let before = faults_of_this_thread();
        one_tick(&mut robot, &mut wait);
        let during = faults_of_this_thread() - before;
        let _ = surroundings.receive();
        faults += if robot.account().status.tick > WARM_UP {
            during
        } else {
            0
        };
    }
    assert_eq!(faults, 0);
}

/// Those that needed no disk, and those that did.
#[allow(
    unsafe_code,
    reason = "usage of one thread is not offered safely by the dependencies"
)]
fn faults_of_this_thread() -> i64 {
    // SAFETY: all-zero is a valid rusage.
    let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
    // SAFETY: usage is a rusage that the kernel fills in.
    let result = unsafe { libc::getrusage(libc::RUSAGE_THREAD, &raw mut usage) };
    assert_eq!(result, 0);
    usage.ru_minflt + usage.ru_majflt
}

/// What the daemon's loop does; whether it came to a tick.
fn one_tick(robot: &mut Robot, wait: &mut Wait) -> bool {
    let wake = wait.wait().unwrap();
    let outcome = robot.wake(wake);
    if wake == Wake::Frame && outcome == Outcome::Ticked {
        wait.frame_came(KernelTime.monotonic_ns()).unwrap();
    }
    outcome == Outcome::Ticked
}
