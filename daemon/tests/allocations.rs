//! A tick allocates nothing, whatever arrives; that the counting works is shown by a case that allocates on purpose.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod by_hand;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use by_hand::{METRES_PER_TICK, PERIOD, World, diagonal};
use coloc_daemon::event::{Event, Link};
use coloc_daemon::wait::Wake;
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{Input, Neighbour, Position, RelativePose};

const TICKS: u64 = 10_000;

std::thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

fn count() {
    // A thread that is ending has no counter any more, and is not being measured.
    let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
}

#[allow(unsafe_code)] // A global allocator is unsafe by its nature; this one only counts.
// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise, passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise, passed on.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promise, passed on.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise, passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Allocations of this thread during `work`.
fn allocations(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    work();
    ALLOCATIONS.get() - before
}

#[test]
fn allocations_are_counted() {
    let counted = allocations(|| {
        let mut numbers = black_box(Vec::<u64>::with_capacity(1));
        numbers.reserve_exact(1000);
        black_box(vec![0_u8; black_box(64)]);
    });
    assert_eq!(counted, 3, "one each of alloc, realloc and alloc_zeroed");
}

/// What telemetry does with the ring: empties it and gives the ledgers back.
fn drain(link: &Link, done: &AtomicBool) {
    while !done.load(Ordering::Relaxed) {
        match link.events.pop() {
            Some(Event::Account(ledger)) => drop(link.spare.push(ledger)),
            Some(_) => {}
            None => std::thread::yield_now(),
        }
    }
}

#[test]
fn ticks_allocate_nothing() {
    let world = World::new();
    // Whoever is told where it is listens as well.
    let told = world
        .space
        .subscriber::<Neighbour>(&by_hand::name("b"))
        .unwrap();
    let mut robot = world.robot("a", 1, &world.wheels());
    let (laser, dgps, neighbour) = (
        world.publisher::<RelativePose>("a"),
        world.publisher::<Position>("a"),
        world.publisher::<Neighbour>("a"),
    );
    let (mut sender, mut frames) = (world.sender(), WheelFrames::new(METRES_PER_TICK));
    let done = Arc::new(AtomicBool::new(false));
    let (link, ended) = (Arc::clone(&robot.link), Arc::clone(&done));
    let telemetry = std::thread::spawn(move || drain(&link, &ended));
    let mut counted = 0;
    for sequence in 0..TICKS {
        world.time.run(PERIOD / 2);
        let header = world.header(sequence);
        let way_m = 1e-3 * f64::from(u32::try_from(sequence).unwrap());
        for frame in frames.encode(way_m, way_m) {
            sender.send(&frame).unwrap();
        }
        laser
            .send(RelativePose {
                header,
                observed: 2,
                covariance: diagonal([0.01; 3]),
                ..RelativePose::default()
            })
            .unwrap();
        // Every other fix is garbage.
        let quality = if sequence % 2 == 0 { 4 } else { 0 };
        dgps.send(Position {
            header,
            quality,
            position: [way_m, 0.0],
            covariance: [0.01, 0.0, 0.0, 0.01],
            ..Position::default()
        })
        .unwrap();
        let pose = [way_m, 0.0, 0.0];
        neighbour
            .send(Neighbour {
                header,
                sender: 2,
                pose,
                total: diagonal([0.01; 3]),
                ..Neighbour::default()
            })
            .unwrap();
        world.time.run(PERIOD / 2);
        let allocated = allocations(|| {
            robot.robot.wake(Wake::Deadline {
                deadline_ns: 0,
                missed: sequence % 100 / 99,
            });
        });
        // The first tick connects the ports of this test, which came after the robot.
        assert!(told.receive().unwrap().is_some());
        counted += if sequence == 0 { 0 } else { allocated };
    }
    done.store(true, Ordering::Relaxed);
    telemetry.join().unwrap();
    let status = robot.robot.account().status;
    assert_eq!(counted, 0);
    for input in Input::ALL {
        assert!(
            status.accepted_of(input) >= TICKS / 2 - 2,
            "{input}: {} accepted",
            status.accepted_of(input)
        );
    }
    assert_eq!(status.rejected_total(Input::Position), TICKS / 2);
}
