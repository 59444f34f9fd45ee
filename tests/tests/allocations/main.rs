//! The real-time thread asks nothing of the allocator: counted over ten thousand real ticks with all inputs arriving.
//!
//! Own test binary, for it replaces the allocator. Between the ticks the same thread plays the surroundings, which is not
//! counted. Counting starts after a warm-up: the first message over a new connection maps its shared memory.
#![allow(
    clippy::unwrap_used,
    reason = "a test fails by panicking, also in its helpers"
)]

mod surroundings;

use std::hint::black_box;
use std::sync::Arc;
use std::sync::mpsc::channel;

use coloc_daemon::clock::{KernelTime, TimeSource};
use coloc_daemon::event::Link;
use coloc_daemon::telemetry::Telemetry;
use coloc_daemon::tick::{Outcome, Robot};
use coloc_daemon::wait::{Wait, Wake};
use coloc_shm_types::{Input, Space};
use coloc_tests::counting::{Calls, calls_during};
use rustix::event::{EventfdFlags, eventfd};

use surroundings::{Surroundings, config};

#[test]
fn the_counter_sees_every_way_to_allocate() {
    let ((), calls) = calls_during(|| {
        let mut grown = black_box(Vec::<u8>::with_capacity(1));
        grown.reserve_exact(1000);
        drop(black_box((grown, vec![0_u8; 100])));
    });
    assert_eq!(
        calls,
        Calls {
            alloc: 1,
            alloc_zeroed: 1,
            realloc: 1,
            dealloc: 2
        }
    );
}

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

    let (mut calls, mut told, mut estimates, mut counted) = (Calls::default(), 0, 0, 0);
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
                (told, estimates) = (told + received.0, estimates + received.1);
            }
        }
        drop(running);
    });

    assert_eq!(calls, Calls::default(), "over {counted} ticks");
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
        estimates as u64 >= ticks && told as u64 >= 4 * ticks,
        "{estimates} estimates, {told} poses told"
    );
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
