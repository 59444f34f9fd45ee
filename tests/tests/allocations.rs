//! The real-time thread asks nothing of the allocator: counted over ten thousand real ticks with all inputs arriving.
//!
//! Between the ticks the same thread plays the surroundings, which is not counted. Counting starts after a warm-up: the
//! first message over a new connection maps its shared memory.
#![allow(
    clippy::unwrap_used,
    reason = "a test fails by panicking, also in its helpers"
)]

use std::thread::sleep;
use std::time::Duration;

use coloc_counting::{Calls, calls_during};
use coloc_daemon::config::Trigger;
use coloc_daemon::config::{Realtime, Scheduler};
use coloc_daemon::realtime;
use coloc_shm_types::{Input, Reader};
use coloc_tests::scene::{Scene, WARM_UP};
use coloc_tests::surroundings::{Heard, Surroundings, realtime_ns};

#[test]
fn no_tick_on_the_timer_allocates() {
    ticks_without_allocation(Trigger::Timer, 10_000);
}

#[test]
fn no_tick_on_a_frame_allocates() {
    ticks_without_allocation(Trigger::Encoder, 10_000);
}

/// While the second wheel's frame is on the wire the tick is rehearsed.
#[test]
fn no_rehearsal_allocates() {
    let mut scene = Scene::new(Trigger::Encoder);
    let (mut calls, mut rehearsed) = (Calls::NONE, 0);
    while scene.robot.account().tick() < 2 * WARM_UP {
        scene.surroundings.send_messages(realtime_ns(), [0.0; 3]);
        let [left, right] = scene.surroundings.frames([0.0; 2]);
        scene.surroundings.send_frame(&left);
        let (_, before) = calls_during(|| scene.turn());
        rehearsed += usize::from(!scene.robot.collect().heard().is_empty());
        sleep(GAP);
        scene.surroundings.send_frame(&right);
        let ((), during) = calls_during(|| while !scene.turn() {});
        let _ = scene.surroundings.receive();
        if scene.is_warm() {
            calls += before;
            calls += during;
        }
    }
    assert_eq!(calls, Calls::NONE);
    // A rehearsal begins with the messages that are there already.
    assert!(rehearsed > 0, "none");
}

/// Long enough for a rehearsal, and no deadline comes in between.
const GAP: Duration = Duration::from_millis(1);

#[test]
fn no_tick_allocates_for_those_who_wait() {
    let mut scene = Scene::new(Trigger::Timer);
    scene.surroundings.wait();
    without_allocation(&mut scene, 10_000);
}

#[test]
fn no_tick_allocates_for_a_group() {
    let mut scene = Scene::for_group(Trigger::Timer);
    let reader = Reader::open(&scene.config.shm.root, &scene.config.robot.name).unwrap();
    reader.bell().unwrap();
    without_allocation(&mut scene, 10_000);
    assert!(reader.newest().unwrap().tick >= 10_000);
}

#[test]
fn no_tick_allocates_for_what_is_seen_in_part() {
    let mut scene = Scene::in_part(Trigger::Timer);
    let (mut calls, mut heard, mut counted) = (Calls::NONE, Heard::default(), 0);
    scene.with_telemetry(|scene| {
        while counted < 10_000 {
            scene.surroundings.send_frames([0.0; 2]);
            scene.surroundings.send_parts(realtime_ns());
            let (ticked, during) = calls_during(|| scene.turn());
            let received = scene.surroundings.receive();
            if scene.is_warm() {
                calls += during;
                counted += u64::from(ticked);
                heard += received;
            }
        }
    });
    assert_eq!(calls, Calls::NONE, "over {counted} ticks");
    let status = scene.robot.account().status();
    for input in [Input::Sighting, Input::Seen, Input::Answer] {
        let accepted = status.accepted_of(input);
        assert!(accepted >= 4 * counted, "{input}: {accepted}; {status:?}");
    }
    assert!(heard.parts >= 8 * counted, "{heard:?}");
}

/// Its samples come in disorder.
#[test]
fn no_tick_with_a_gyro_allocates() {
    let mut scene = Scene::with_gyro(Trigger::Timer);
    without_allocation_given(&mut scene, 10_000, Surroundings::send_with_turns);
}

fn ticks_without_allocation(trigger: Trigger, ticks: u64) {
    without_allocation(&mut Scene::new(trigger), ticks);
}

fn without_allocation(scene: &mut Scene, ticks: u64) {
    without_allocation_given(scene, ticks, Surroundings::send);
}

/// Each tick after what `send` has brought.
fn without_allocation_given(scene: &mut Scene, ticks: u64, send: fn(&mut Surroundings)) {
    let (mut calls, mut heard, mut counted) = (Calls::NONE, Heard::default(), 0);
    scene.with_telemetry(|scene| {
        while counted < ticks {
            send(&mut scene.surroundings);
            let (ticked, during) = calls_during(|| scene.turn());
            let received = scene.surroundings.receive();
            if scene.is_warm() {
                calls += during;
                counted += u64::from(ticked);
                heard += received;
            }
        }
    });

    assert_eq!(calls, Calls::NONE, "over {counted} ticks");
    let status = scene.robot.account().status();
    let has_gyro = scene.config.gyro.settings().is_some();
    // Leaders and children, rounds, and second opinions are in the daemon's own tests.
    let elsewhere = |it| {
        matches!(
            it,
            Input::Sighting
                | Input::Seen
                | Input::Answer
                | Input::Assist
                | Input::AssistAck
                | Input::Readings
                | Input::Correction
                | Input::Integrity
        )
    };
    for input in Input::ALL
        .into_iter()
        .filter(|it| !elsewhere(*it) && (has_gyro || *it != Input::Gyro))
    {
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
    let mut scene = Scene::new(Trigger::Timer);
    let memory = Realtime {
        scheduler: Scheduler::Other,
        ..scene.config.realtime.clone()
    };
    let refused = realtime::set_up(&memory);
    if let Some(refused) = refused.first() {
        eprintln!("SKIPPED: page faults on the real-time thread: {refused}");
        return;
    }
    let mut faults = 0;
    while scene.robot.account().tick() < 2000 {
        scene.surroundings.send();
        let before = faults_of_this_thread();
        scene.turn();
        let during = faults_of_this_thread() - before;
        let _ = scene.surroundings.receive();
        faults += if scene.is_warm() { during } else { 0 };
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
