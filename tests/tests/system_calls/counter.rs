//! Counts the system calls of one thread by itself: a seccomp filter that asks about each of them, and a supervisor that
//! counts and lets it go on.
//!
//! The supervisor answers before the call begins, so the thread that is counted can read the counts whenever it likes and
//! finds in them exactly what it has done. Neither root nor another program is needed.

use std::ffi::c_long;
use std::fmt;
use std::ops::Sub;
use std::os::fd::{AsFd, AsRawFd, FromRawFd, OwnedFd};
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};

use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::Errno;

/// More than any architecture's kernel has; a call beyond is counted under the last one.
const NUMBERS: usize = 1024;

/// So many calls, by number.
#[derive(Copy, Clone, PartialEq, Eq)]
pub(crate) struct SystemCalls([u32; NUMBERS]);

impl SystemCalls {
    pub(crate) fn total(&self) -> u32 {
        self.0.iter().sum()
    }

    /// How often `number`.
    pub(crate) fn of(&self, number: c_long) -> u32 {
        usize::try_from(number).map_or(0, |number| self.0[number])
    }

    /// `(number, how often)` of those that were made.
    pub(crate) fn made(&self) -> impl Iterator<Item = (c_long, u32)> {
        (0..).zip(self.0).filter(|&(_, count)| count > 0)
    }
}

impl fmt::Debug for SystemCalls {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_map().entries(self.made()).finish()
    }
}

impl Sub for SystemCalls {
    type Output = Self;

    fn sub(mut self, before: Self) -> Self {
        (self.0.iter_mut().zip(before.0)).for_each(|(count, before)| *count -= before);
        self
    }
}

/// What the thread and its supervisor share.
pub(crate) struct Counter {
    counts: [AtomicU32; NUMBERS],
    /// Whose descriptor the supervisor listens on.
    listener: AtomicI32,
}

const NOT_YET: i32 = -1;
const NEVER: i32 = -2;

impl Counter {
    pub(crate) fn new() -> Self {
        Self {
            counts: [const { AtomicU32::new(0) }; NUMBERS],
            listener: AtomicI32::new(NOT_YET),
        }
    }

    /// From now on every call of this thread is counted, up to its end, and it needs the supervisor for each.
    pub(crate) fn count_this_thread(&self) -> Result<(), Errno> {
        let listener = rustix::thread::set_no_new_privs(true).and_then(|()| listen());
        // Through an atomic: waking somebody who waits would be a call, and there is no supervisor yet.
        self.listener
            .store(*listener.as_ref().unwrap_or(&NEVER), Ordering::Release);
        listener.map(drop)
    }

    /// What this thread has done so far.
    pub(crate) fn so_far(&self) -> SystemCalls {
        SystemCalls(std::array::from_fn(|number| {
            self.counts[number].load(Ordering::Acquire)
        }))
    }

    /// Nothing will be counted any more.
    pub(crate) fn end(&self) {
        let _ =
            (self.listener).compare_exchange(NOT_YET, NEVER, Ordering::AcqRel, Ordering::Acquire);
    }

    /// The supervisor: works until the thread that is counted has ended, or it is clear that none will be.
    ///
    /// Allocates nothing: the other thread may hold the allocator's lock while it waits for an answer.
    pub(crate) fn supervise(&self) {
        let listener = loop {
            match self.listener.load(Ordering::Acquire) {
                NOT_YET => std::thread::yield_now(),
                NEVER => return,
                listener => break listener,
            }
        };
        #[allow(unsafe_code, reason = "the descriptor came as a number")]
        // SAFETY: listen() made it, and nobody else owns it.
        let listener = unsafe { OwnedFd::from_raw_fd(listener) };
        while let Some(call) = next_call(&listener) {
            let number = usize::try_from(call.data.nr).unwrap_or(NUMBERS);
            self.counts[number.min(NUMBERS - 1)].fetch_add(1, Ordering::Release);
            go_on(&listener, call.id);
        }
    }
}

/// Asks about every call of this thread; the number of the descriptor where the questions arrive.
#[allow(
    unsafe_code,
    reason = "the dependencies do not offer seccomp in a safe form"
)]
fn listen() -> Result<i32, Errno> {
    let mut ask = libc::sock_filter {
        code: RETURN_CONSTANT,
        jt: 0,
        jf: 0,
        k: libc::SECCOMP_RET_USER_NOTIF,
    };
    let program = libc::sock_fprog {
        len: 1,
        filter: &raw mut ask,
    };
    // SAFETY: the program is one instruction, which the kernel copies; without TSYNC this concerns this thread alone.
    let listener = unsafe {
        libc::syscall(
            libc::SYS_seccomp,
            libc::SECCOMP_SET_MODE_FILTER,
            libc::SECCOMP_FILTER_FLAG_NEW_LISTENER,
            &raw const program,
        )
    };
    i32::try_from(listener)
        .ok()
        .filter(|&listener| listener >= 0)
        .ok_or_else(last_error)
}

/// `BPF_RET | BPF_K` of `linux/bpf_common.h`.
const RETURN_CONSTANT: u16 = 0x06;

/// Waits for the next question; none comes any more when the thread has ended.
fn next_call(listener: &OwnedFd) -> Option<libc::seccomp_notif> {
    loop {
        let mut polled = [PollFd::from_borrowed_fd(listener.as_fd(), PollFlags::IN)];
        match poll(&mut polled, None) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(_) => return None,
        }
        let events = polled[0].revents();
        if events.contains(PollFlags::IN) {
            match receive(listener) {
                Ok(call) => return Some(call),
                // The thread was interrupted before its question was read, and will ask again.
                Err(Errno::INTR | Errno::NOENT) => {}
                Err(_) => return None,
            }
        } else if !events.is_empty() {
            return None;
        }
    }
}

#[allow(
    unsafe_code,
    reason = "the dependencies do not offer seccomp in a safe form"
)]
fn receive(listener: &OwnedFd) -> Result<libc::seccomp_notif, Errno> {
    // SAFETY: all-zero is a valid seccomp_notif, and what the kernel asks for.
    let mut call: libc::seccomp_notif = unsafe { std::mem::zeroed() };
    // SAFETY: the request is the one for this structure, which the kernel fills in.
    let result = unsafe {
        libc::ioctl(
            listener.as_raw_fd(),
            libc::SECCOMP_IOCTL_NOTIF_RECV,
            &raw mut call,
        )
    };
    (result == 0).then_some(call).ok_or_else(last_error)
}

/// Lets the kernel do what it was asked to do.
#[allow(
    unsafe_code,
    reason = "the dependencies do not offer seccomp in a safe form"
)]
fn go_on(listener: &OwnedFd, id: u64) {
    let mut answer = libc::seccomp_notif_resp {
        id,
        val: 0,
        error: 0,
        flags: GO_ON,
    };
    // SAFETY: the request is the one for this structure. If the thread is not waiting any more, nothing happens.
    unsafe {
        libc::ioctl(
            listener.as_raw_fd(),
            libc::SECCOMP_IOCTL_NOTIF_SEND,
            &raw mut answer,
        );
    }
}

/// `SECCOMP_USER_NOTIF_FLAG_CONTINUE`, in the type of its field.
const GO_ON: u32 = 1;

fn last_error() -> Errno {
    Errno::from_io_error(&std::io::Error::last_os_error()).unwrap_or(Errno::IO)
}
