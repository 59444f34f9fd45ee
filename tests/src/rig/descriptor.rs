//! The robot's CAN socket, seen from outside its code: a number in `/proc/self/fd`.
#![allow(
    unsafe_code,
    reason = "closing a descriptor that somebody else owns is the fault to be made"
)]

use std::collections::BTreeSet;
use std::fs::File;
use std::os::fd::{AsRawFd, BorrowedFd};

use rustix::net::{AddressFamily, SocketAddrUnix, getsockname, sockopt};

use super::bus::Line;

/// All sockets of this process.
pub(super) fn sockets() -> BTreeSet<i32> {
    let entries = std::fs::read_dir("/proc/self/fd").unwrap();
    let is_socket = |fd: &i32| {
        std::fs::read_link(format!("/proc/self/fd/{fd}"))
            .is_ok_and(|target| target.to_string_lossy().starts_with("socket:"))
    };
    let numbers = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    numbers.filter(is_socket).collect()
}

/// The socket of `line`'s kind that was not there `before`.
pub(super) fn the_new_one(before: &BTreeSet<i32>, line: &Line) -> i32 {
    let family = match line {
        Line::Local(_) => AddressFamily::UNIX,
        _ => AddressFamily::CAN,
    };
    let is_of_the_bus = |fd: &&i32| {
        // SAFETY: it was open a moment ago, is only asked, and only by the thread that opened it.
        let socket = unsafe { BorrowedFd::borrow_raw(**fd) };
        // A local bus is heard at a path; who only rings bells has none.
        sockopt::socket_domain(socket) == Ok(family)
            && (family == AddressFamily::CAN || has_path(socket))
    };
    let after = sockets();
    let new: Vec<_> = after.difference(before).filter(is_of_the_bus).collect();
    assert_eq!(new.len(), 1, "one bus, one socket: {new:?}");
    *new[0]
}

fn has_path(socket: BorrowedFd<'_>) -> bool {
    let address = getsockname(socket).and_then(SocketAddrUnix::try_from);
    address.is_ok_and(|it| it.path().is_some())
}

/// Has the kernel keep no more on `fd` than `bytes` for whoever owns it.
pub(super) fn limit(fd: i32, bytes: usize) {
    // SAFETY: it is open, and only asked to be smaller.
    let socket = unsafe { BorrowedFd::borrow_raw(fd) };
    sockopt::set_socket_recv_buffer_size(socket, bytes).unwrap();
}

/// Closes `fd`, whoever owns it; with `reuse` the number means another file from then on.
pub(super) fn close(fd: i32, reuse: bool) {
    // SAFETY: not sound in general, which is the point: the owner must cope. It does so by asking the kernel whose the
    // descriptor is, which this test proves.
    unsafe { rustix::io::close(fd) };
    if reuse {
        let other = File::open("/dev/null").unwrap();
        assert_eq!(other.as_raw_fd(), fd, "the kernel gives the lowest number");
        std::mem::forget(other);
    }
}
