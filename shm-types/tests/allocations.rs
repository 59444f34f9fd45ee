//! The hot path allocates nothing; that the counting works is shown by a case that allocates on purpose.
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;

use coloc_shm_types::{
    Estimate, Header, Limits, Neighbour, Position, RelativePose, Replay, RobotName, Space,
};

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

#[test]
fn sending_and_receiving_allocate_nothing() {
    let root = tempfile::tempdir().unwrap();
    let robot = RobotName::new("r1").unwrap();
    let space = Space::open(root.path(), "t", "test").unwrap();
    let publisher = space.publisher::<Estimate>(&robot).unwrap();
    let subscribers = [0; 3].map(|_| space.subscriber::<Estimate>(&robot).unwrap());
    publisher.refresh().unwrap();
    for subscriber in &subscribers {
        subscriber.refresh().unwrap();
    }
    let mut received = 0_u64;
    let counted = allocations(|| {
        for tick in 0..10_000 {
            publisher
                .send(Estimate {
                    tick,
                    ..Estimate::default()
                })
                .unwrap();
            // The first reads everything, the second nothing (it overflows), the third every other.
            while subscribers[0].receive().unwrap().is_some() {
                received += 1;
            }
            if tick % 2 == 0 {
                black_box(subscribers[2].receive().unwrap());
            }
        }
    });
    assert_eq!(received, 10_000);
    assert_eq!(counted, 0);
}

#[test]
fn checking_allocates_nothing() {
    let limits = Limits {
        now_ns: 10,
        history_ns: 5,
        future_tolerance_ns: 1,
        set_back_ns: 0,
        own: 1,
        robots: &[1, 2, 3],
    };
    let mut replay = Replay::new();
    let counted = allocations(|| {
        for sequence in 0..1000 {
            let header = Header {
                stamp_ns: 8,
                session_ns: 1,
                sequence,
            };
            black_box(
                RelativePose {
                    header,
                    ..RelativePose::default()
                }
                .validate(&limits),
            )
            .ok();
            black_box(
                Position {
                    header,
                    ..Position::default()
                }
                .validate(&limits),
            )
            .ok();
            black_box(
                Neighbour {
                    header,
                    sender: 2,
                    ..Neighbour::default()
                }
                .validate(&limits),
            )
            .unwrap();
            replay.accept(&header).unwrap();
        }
    });
    assert_eq!(counted, 0);
}
