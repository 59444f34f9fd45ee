//! An allocator that counts, for each thread by itself.
//!
//! Whatever links this crate runs on it: the tests that must show that something allocates nothing. It is the system's
//! allocator otherwise.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ops::{AddAssign, Sub};

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How often a thread has called the allocator.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Calls {
    /// `alloc`
    pub alloc: u64,
    /// `alloc_zeroed`
    pub alloc_zeroed: u64,
    /// `realloc`
    pub realloc: u64,
    /// `dealloc`
    pub dealloc: u64,
}

thread_local! {
    // Constant and without a destructor: reading it allocates nothing, also while the thread begins or ends.
    static CALLS: Cell<Calls> = const { Cell::new(Calls::NONE) };
}

impl Calls {
    /// What the real-time thread may do.
    pub const NONE: Self = Self {
        alloc: 0,
        alloc_zeroed: 0,
        realloc: 0,
        dealloc: 0,
    };
}

/// What this thread asks of the allocator while `body` runs, beside its result.
pub fn calls_during<T>(body: impl FnOnce() -> T) -> (T, Calls) {
    let before = CALLS.get();
    let result = body();
    (result, CALLS.get() - before)
}

impl Sub for Calls {
    type Output = Self;

    fn sub(self, before: Self) -> Self {
        Self {
            alloc: self.alloc - before.alloc,
            alloc_zeroed: self.alloc_zeroed - before.alloc_zeroed,
            realloc: self.realloc - before.realloc,
            dealloc: self.dealloc - before.dealloc,
        }
    }
}

impl AddAssign for Calls {
    fn add_assign(&mut self, more: Self) {
        self.alloc += more.alloc;
        self.alloc_zeroed += more.alloc_zeroed;
        self.realloc += more.realloc;
        self.dealloc += more.dealloc;
    }
}

struct Counting;

fn count(add: impl FnOnce(&mut Calls)) {
    let mut calls = CALLS.get();
    add(&mut calls);
    CALLS.set(calls);
}

#[allow(unsafe_code, reason = "an allocator can be replaced in no other way")]
// SAFETY: every call goes to the system's allocator as it came; counting touches no memory but the thread's own cell.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(|calls| calls.alloc += 1);
        // SAFETY: the caller keeps `alloc`'s contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(|calls| calls.alloc_zeroed += 1);
        // SAFETY: the caller keeps `alloc_zeroed`'s contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(|calls| calls.realloc += 1);
        // SAFETY: the caller keeps `realloc`'s contract, and all blocks are the system's.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        count(|calls| calls.dealloc += 1);
        // SAFETY: as for `realloc`.
        unsafe { System.dealloc(block, layout) }
    }
}

#[cfg(test)]
mod tests {
    use std::hint::black_box;

    use super::*;

    #[test]
    fn every_way_to_allocate_is_seen() {
        let ((), calls) = calls_during(|| {
            let mut grown = black_box(Vec::<u8>::with_capacity(1));
            grown.reserve_exact(1000);
            drop(black_box((grown, vec![0_u8; 100])));
        });
        let expected = Calls {
            alloc: 1,
            alloc_zeroed: 1,
            realloc: 1,
            dealloc: 2,
        };
        assert_eq!(calls, expected);
    }

    #[test]
    fn threads_are_counted_apart() {
        let other = std::thread::spawn(|| calls_during(|| black_box(Box::new(1))).1);
        // Joining frees what the thread has left behind.
        let ((), calls) = calls_during(|| while !other.is_finished() {});
        assert_eq!(calls, Calls::NONE);
        assert_eq!(other.join().map(|calls| calls.alloc).ok(), Some(1));
    }
}
