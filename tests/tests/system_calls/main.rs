//! What the real-time thread asks of the kernel, tick by tick, with all inputs arriving; and that it takes no lock.
//!
//! A lock that has to wait is a `futex` call, whoever's lock it is. The C library's are counted besides: they may have been
//! free by chance.
#![allow(
    clippy::unwrap_used,
    reason = "a test fails by panicking, also in its helpers"
)]

mod counter;
mod locks;

use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::{park_timeout, scope, sleep, spawn};
use std::time::Duration;

use coloc_daemon::config::Trigger;
use coloc_drivers::can::Sender;
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{Estimate, Reader, Subscriber};
use coloc_tests::scene::Scene;
use coloc_tests::surroundings::{Surroundings, realtime_ns};
use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::Errno;
use rustix::process::getppid;

use counter::{Counter, SystemCalls};

/// What a tick may need, the median one: now and then one looks after its bus as well.
const MOST_CALLS: u32 = 4;
const TICKS: usize = 1000;
const PERIOD: Duration = Duration::from_millis(2);

/// Waiting, receiving, and how the bus is doing: none of them waits for another thread. Where the kernel offers clocks
/// without a call, they are read without one.
const EXPECTED: [libc::c_long; 7] = [
    libc::SYS_epoll_pwait,
    libc::SYS_read,
    libc::SYS_recvmmsg,
    libc::SYS_getsockopt,
    libc::SYS_newfstatat,
    libc::SYS_timerfd_settime,
    libc::SYS_clock_gettime,
];

#[test]
fn a_tick_on_the_timer() {
    hold(Trigger::Timer, |_| Surroundings::send);
}

#[test]
fn a_tick_with_a_gyro() {
    hold_in(
        || Scene::with_gyro(Trigger::Timer),
        |_| Surroundings::send_with_turns,
    );
}

/// It takes what leaders say, hands it on and answers.
#[test]
fn a_tick_of_a_child() {
    hold_in(
        || Scene::carried(Trigger::Timer),
        |_| Surroundings::send_with_data,
    );
}

#[test]
fn a_tick_on_two_frames_at_once() {
    hold(Trigger::Encoder, |_| {
        |surroundings: &mut Surroundings| {
            sleep(PERIOD);
            surroundings.send();
        }
    });
}

/// Between the two the tick is rehearsed, without a call more.
#[test]
fn a_tick_on_two_frames_one_after_the_other() {
    one_after_the_other(Trigger::Encoder);
}

#[test]
fn a_tick_on_whatever_comes() {
    one_after_the_other(Trigger::Auto);
}

fn one_after_the_other(trigger: Trigger) {
    hold(trigger, |scene| {
        let wheels = Sender::open(&scene.surroundings.bus).unwrap();
        let (running, stopped) = channel();
        spawn(move || send_one_after_the_other(wheels, &stopped));
        move |surroundings: &mut Surroundings| {
            let _ = &running; // Frames come for as long as messages do.
            surroundings.send_messages(realtime_ns(), [0.0; 3]);
        }
    });
}

/// Until the other end of `stop` is dropped, and at a pace of its own.
fn send_one_after_the_other(mut wheels: Sender, stop: &Receiver<()>) {
    let mut frames = WheelFrames::new(1.0);
    let stopped_within = |pause| stop.recv_timeout(pause) != Err(RecvTimeoutError::Timeout);
    loop {
        let [left, right] = frames.encode(0.0, 0.0);
        wheels.send(&left).unwrap();
        if stopped_within(PERIOD / 4) {
            return;
        }
        wheels.send(&right).unwrap();
        if stopped_within(3 * (PERIOD / 4)) {
            return;
        }
    }
}

#[test]
fn a_tick_calls_once_for_each_who_waits_and_for_nobody_else() {
    let prepare = |scene: &Scene| {
        // It hears one estimate, and does not come back: for it nothing is done any more.
        let space = scene.config.open_space("forgetful").unwrap();
        let forgetful: Subscriber<Estimate> = space.subscriber(&scene.config.robot.name).unwrap();
        assert!(forgetful.wait(Duration::ZERO).unwrap().is_none());
        scene.surroundings.estimates.bell().unwrap();
        move |surroundings: &mut Surroundings| {
            let _ = &forgetful;
            surroundings.send();
        }
    };
    let Some(ticks) = ticks(Trigger::Timer, prepare) else {
        return;
    };
    for Tick { calls, locks } in &ticks {
        assert_eq!((calls.of(libc::SYS_sendto), *locks), (1, 0), "{calls:?}");
        assert!(!unexpected(calls, &[libc::SYS_sendto]), "{calls:?}");
    }
    hold_number(&ticks, MOST_CALLS + 1);
}

#[test]
fn a_tick_calls_once_for_all_who_wait_in_a_group() {
    let prepare = |scene: &Scene| {
        let readers = [reader(scene), reader(scene)];
        move |surroundings: &mut Surroundings| {
            readers.iter().for_each(take_a_ring);
            surroundings.send();
        }
    };
    let Some(ticks) = ticks_of(|| Scene::for_group(Trigger::Timer), prepare) else {
        return;
    };
    for Tick { calls, locks } in &ticks {
        assert_eq!((calls.of(libc::SYS_sendto), *locks), (1, 0), "{calls:?}");
        assert!(!unexpected(calls, &[libc::SYS_sendto]), "{calls:?}");
    }
    hold_number(&ticks, MOST_CALLS + 1);
}

/// More rings do not fit into its connection.
const RINGS: u32 = 20;

#[test]
fn a_tick_does_not_call_for_who_reads_without_waiting_or_does_not_come_back() {
    let prepare = |scene: &Scene| {
        let (forgetful, looks) = (reader(scene), reader(scene));
        forgetful.bell().unwrap();
        move |surroundings: &mut Surroundings| {
            let _ = (&forgetful, looks.newest());
            surroundings.send();
        }
    };
    let Some(ticks) = ticks_of(|| Scene::for_group(Trigger::Timer), prepare) else {
        return;
    };
    for Tick { calls, locks } in &ticks {
        assert_eq!((calls.of(libc::SYS_futex), *locks), (0, 0), "{calls:?}");
        assert!(!unexpected(calls, &[libc::SYS_sendto]), "{calls:?}");
    }
    let rung = ticks.iter().map(|it| it.calls.of(libc::SYS_sendto));
    assert!(rung.sum::<u32>() < RINGS);
    hold_number(&ticks, MOST_CALLS);
}

fn reader(scene: &Scene) -> Reader {
    Reader::open(&scene.config.shm.root, &scene.config.robot.name).unwrap()
}

/// Once it has come, the next estimate rings.
fn take_a_ring(reader: &Reader) {
    let bell = reader.bell().unwrap();
    let mut waited = [PollFd::from_borrowed_fd(bell, PollFlags::IN)];
    assert!(poll(&mut waited, None).unwrap() > 0);
    while reader.receive().unwrap().is_some() {}
}

fn hold<A>(trigger: Trigger, prepare: impl FnOnce(&Scene) -> A + Send)
where
    A: FnMut(&mut Surroundings),
{
    hold_in(|| Scene::new(trigger), prepare);
}

/// Ticks, each after what `prepare` made has brought it its inputs, while nobody waits.
fn hold_in<A>(scene: impl FnOnce() -> Scene + Send, prepare: impl FnOnce(&Scene) -> A + Send)
where
    A: FnMut(&mut Surroundings),
{
    let Some(ticks) = ticks_of(scene, prepare) else {
        return;
    };
    for Tick { calls, locks } in &ticks {
        assert_eq!(calls.of(libc::SYS_futex), 0, "waits for a lock: {calls:?}");
        assert!(!unexpected(calls, &[]), "by number: {calls:?}");
        assert_eq!(*locks, 0, "locks of the C library");
    }
    hold_number(&ticks, MOST_CALLS);
}

fn unexpected(calls: &SystemCalls, besides: &[libc::c_long]) -> bool {
    let mut made = calls.made();
    made.any(|(number, _)| !EXPECTED.contains(&number) && !besides.contains(&number))
}

fn hold_number(ticks: &[Tick], most: u32) {
    let mut totals: Vec<u32> = ticks.iter().map(|tick| tick.calls.total()).collect();
    let (_, median, _) = totals.select_nth_unstable(TICKS / 2);
    assert!(
        (1..=most).contains(median),
        "{median} calls; the last ticks: {:?}",
        &ticks[TICKS - 5..]
    );
}

fn ticks<A>(trigger: Trigger, prepare: impl FnOnce(&Scene) -> A + Send) -> Option<Vec<Tick>>
where
    A: FnMut(&mut Surroundings),
{
    ticks_of(|| Scene::new(trigger), prepare)
}

fn ticks_of<A>(
    scene: impl FnOnce() -> Scene + Send,
    prepare: impl FnOnce(&Scene) -> A + Send,
) -> Option<Vec<Tick>>
where
    A: FnMut(&mut Surroundings),
{
    on_a_counted_thread(|counter| {
        let mut scene = scene();
        let mut arrive = prepare(&scene);
        scene.with_telemetry(|scene| {
            while !scene.is_warm() {
                tick(scene, &mut arrive, counter);
            }
            counter.count_this_thread()?;
            Ok((0..TICKS)
                .map(|_| tick(scene, &mut arrive, counter))
                .collect::<Vec<_>>())
        })
    })
}

/// What the real-time thread does in a tick.
#[derive(Debug)]
struct Tick {
    calls: SystemCalls,
    locks: u64,
}

fn tick(scene: &mut Scene, arrive: &mut impl FnMut(&mut Surroundings), counter: &Counter) -> Tick {
    arrive(&mut scene.surroundings);
    let (calls, locks) = (counter.so_far(), locks::taken());
    while !scene.turn() {}
    let tick = Tick {
        calls: counter.so_far() - calls,
        locks: locks::taken() - locks,
    };
    let _ = scene.surroundings.receive();
    tick
}

/// `body` in a thread of its own, next to the one that counts; nothing where the kernel refuses to count.
fn on_a_counted_thread<T: Send>(
    body: impl FnOnce(&Counter) -> Result<T, Errno> + Send,
) -> Option<T> {
    let counter = Counter::new();
    let result = scope(|threads| {
        threads.spawn(|| counter.supervise());
        let result = threads.spawn(|| body(&counter)).join();
        counter.end();
        result
    });
    match result {
        Ok(Ok(result)) => Some(result),
        Ok(Err(refused)) => {
            eprintln!(
                "SKIPPED: system calls and locks of the real-time thread: seccomp is refused here: {refused}"
            );
            None
        }
        Err(panic) => resume_unwind(panic),
    }
}

#[test]
fn the_counter_sees_calls_and_waiting() {
    let calls = on_a_counted_thread(|counter| {
        counter.count_this_thread()?;
        let before = counter.so_far();
        assert_eq!(getppid(), getppid());
        park_timeout(Duration::from_nanos(1)); // What a lock does that has to wait.
        Ok(counter.so_far() - before)
    });
    let Some(calls) = calls else { return };
    assert_eq!(calls.of(libc::SYS_getppid), 2);
    assert_eq!((calls.of(libc::SYS_futex), calls.total()), (1, 3));
}
