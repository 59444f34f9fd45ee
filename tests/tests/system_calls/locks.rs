//! Counts the locks of the C library that a thread takes: this binary's own `pthread_mutex_lock` and its kin, which count and
//! go on to the library's.
//!
//! That covers iceoryx2 and all Rust code. Rust's own locks are no C library's: they are an atomic, and a `futex` call
//! when they must wait. What the library does within itself stays unseen; its allocator is counted elsewhere.

use std::cell::Cell;
use std::ffi::{CStr, c_int};
use std::sync::atomic::{AtomicPtr, Ordering};

thread_local! {
    static TAKEN: Cell<u64> = const { Cell::new(0) };
}

/// How many locks this thread has taken, or tried to take, so far.
pub(crate) fn taken() -> u64 {
    TAKEN.get()
}

macro_rules! counted {
    ($($name:ident($($argument:ident: $kind:ty),+);)+) => {$(
        #[allow(unsafe_code, reason = "a function of the C library can be replaced in no other way")]
        // SAFETY: its name is the library's, and so is its signature.
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $name($($argument: $kind),+) -> c_int {
            static NEXT: AtomicPtr<libc::c_void> = AtomicPtr::new(std::ptr::null_mut());
            const NAME: &CStr = match CStr::from_bytes_with_nul(concat!(stringify!($name), "\0").as_bytes()) {
                Ok(name) => name,
                Err(_) => panic!("a name is without zeros"),
            };
            TAKEN.set(TAKEN.get() + 1);
            let next = next(&NEXT, NAME);
            // SAFETY: it is the library's function of this name, so it has this signature.
            let next: unsafe extern "C" fn($($kind),+) -> c_int = unsafe { std::mem::transmute(next) };
            // SAFETY: the caller keeps the library's contract.
            unsafe { next($($argument),+) }
        }
    )+};
}

counted! {
    pthread_mutex_lock(mutex: *mut libc::pthread_mutex_t);
    pthread_mutex_trylock(mutex: *mut libc::pthread_mutex_t);
    pthread_mutex_timedlock(mutex: *mut libc::pthread_mutex_t, until: *const libc::timespec);
    pthread_rwlock_rdlock(lock: *mut libc::pthread_rwlock_t);
    pthread_rwlock_tryrdlock(lock: *mut libc::pthread_rwlock_t);
    pthread_rwlock_wrlock(lock: *mut libc::pthread_rwlock_t);
    pthread_rwlock_trywrlock(lock: *mut libc::pthread_rwlock_t);
}

/// The library's own `name`, looked up once.
#[allow(unsafe_code, reason = "symbols are looked up through the C library")]
fn next(known: &AtomicPtr<libc::c_void>, name: &CStr) -> *mut libc::c_void {
    let next = known.load(Ordering::Relaxed);
    if !next.is_null() {
        return next;
    }
    // SAFETY: the name ends with a zero.
    let next = unsafe { libc::dlsym(libc::RTLD_NEXT, name.as_ptr()) };
    if next.is_null() {
        std::process::abort(); // No lock can be taken, nor a panic be reported without one.
    }
    known.store(next, Ordering::Relaxed);
    next
}

#[test]
#[allow(unsafe_code, reason = "these are functions of the C library")]
fn a_lock_is_seen() {
    let before = taken();
    let mut mutex = libc::PTHREAD_MUTEX_INITIALIZER;
    // SAFETY: the mutex is initialized, and nobody else knows it.
    let (locked, again, unlocked) = unsafe {
        (
            libc::pthread_mutex_lock(&raw mut mutex),
            libc::pthread_mutex_trylock(&raw mut mutex),
            libc::pthread_mutex_unlock(&raw mut mutex),
        )
    };
    assert_eq!((locked, again, unlocked), (0, libc::EBUSY, 0));
    assert_eq!(taken() - before, 2);
}
