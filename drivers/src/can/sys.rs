//! The few calls of the kernel's socket interface that no library offers without allocating.
#![allow(
    unsafe_code,
    reason = "recvmmsg with control messages and CAN socket options exist only as C calls"
)]

use std::ffi::c_int;
use std::mem::MaybeUninit;
use std::os::fd::{AsRawFd, BorrowedFd, FromRawFd, OwnedFd};

use rustix::io::Errno;

use super::frame::FD_SIZE;

#[expect(
    clippy::cast_possible_truncation,
    reason = "29, and the kernel's type for it is narrow"
)]
const CAN_FAMILY: libc::sa_family_t = libc::AF_CAN as libc::sa_family_t;
#[expect(clippy::cast_possible_truncation, reason = "a few bytes")]
const SOCKADDR_CAN_SIZE: libc::socklen_t = size_of::<libc::sockaddr_can>() as libc::socklen_t;
#[expect(clippy::cast_possible_truncation, reason = "a few bytes")]
const SOCK_FPROG_SIZE: libc::socklen_t = size_of::<libc::sock_fprog>() as libc::socklen_t;

/// One datagram as the kernel handed it over.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Datagram {
    /// Bytes written to the buffer.
    pub(super) len: usize,
    /// It was longer than the buffer.
    pub(super) truncated: bool,
    /// When the kernel received it \[ns of `CLOCK_REALTIME`\].
    pub(super) stamp_ns: Option<i64>,
    /// Datagrams dropped since the socket was opened because its buffer was full; wraps.
    pub(super) dropped: Option<u32>,
}

/// Room for a `timespec` and a drop count, each with its header; aligned as headers must be.
#[repr(C, align(8))]
struct Control([MaybeUninit<u8>; 128]);

/// The most datagrams that one call of [`receive`] takes.
pub(super) const BATCH: usize = 8;
#[expect(clippy::cast_possible_truncation, reason = "eight")]
const BATCH_COUNT: libc::c_uint = BATCH as libc::c_uint;

/// Takes datagrams off the socket, with the kernel's stamps and drop counts, one into each of `buffers`; never blocks.
/// Fewer than [`BATCH`] came if there were no more: one system call is enough to know. Returns how many.
pub(super) fn receive(
    socket: BorrowedFd<'_>,
    buffers: &mut [[u8; FD_SIZE]; BATCH],
    datagrams: &mut [Datagram; BATCH],
) -> Result<usize, Errno> {
    let mut controls = [const { Control([MaybeUninit::uninit(); 128]) }; BATCH];
    let mut io = buffers.each_mut().map(|buffer| libc::iovec {
        iov_base: buffer.as_mut_ptr().cast(),
        iov_len: buffer.len(),
    });
    // SAFETY: all-zero is a valid mmsghdr (null pointers, zero lengths).
    let mut messages: [libc::mmsghdr; BATCH] = unsafe { std::mem::zeroed() };
    for ((message, io), control) in messages.iter_mut().zip(&mut io).zip(&mut controls) {
        message.msg_hdr.msg_iov = io;
        message.msg_hdr.msg_iovlen = 1;
        message.msg_hdr.msg_control = control.0.as_mut_ptr().cast();
        message.msg_hdr.msg_controllen = size_of::<Control>() as _;
    }
    // SAFETY: messages point at buffers and controls, which outlive the call, with their true lengths.
    let count = check(unsafe {
        libc::recvmmsg(
            socket.as_raw_fd(),
            messages.as_mut_ptr(),
            BATCH_COUNT,
            libc::MSG_DONTWAIT as _,
            std::ptr::null_mut(),
        )
    })?;
    let count = usize::try_from(count).unwrap_or(0);
    for (message, datagram) in messages.iter().zip(datagrams).take(count) {
        *datagram = Datagram {
            len: usize::try_from(message.msg_len).unwrap_or(0),
            truncated: message.msg_hdr.msg_flags & libc::MSG_TRUNC != 0,
            ..Datagram::default()
        };
        // SAFETY: recvmmsg left it so, the control buffers still live.
        unsafe { read_control(&message.msg_hdr, datagram) };
    }
    Ok(count)
}

/// # Safety
/// `message` must be as `recvmmsg` left it, its control buffer alive.
unsafe fn read_control(message: &libc::msghdr, datagram: &mut Datagram) {
    // SAFETY: by this function's contract the headers lie within the control buffer and were written by the kernel,
    // which puts a timespec behind SO_TIMESTAMPNS and a u32 behind SO_RXQ_OVFL; data may be unaligned.
    unsafe {
        let mut header = libc::CMSG_FIRSTHDR(message);
        while let Some(head) = header.as_ref() {
            let data = libc::CMSG_DATA(header);
            match (head.cmsg_level, head.cmsg_type) {
                (libc::SOL_SOCKET, libc::SCM_TIMESTAMPNS) => {
                    datagram.stamp_ns =
                        Some(nanoseconds(data.cast::<libc::timespec>().read_unaligned()));
                }
                (libc::SOL_SOCKET, libc::SO_RXQ_OVFL) => {
                    datagram.dropped = Some(data.cast::<u32>().read_unaligned());
                }
                _ => {}
            }
            header = libc::CMSG_NXTHDR(message, header);
        }
    }
}

fn nanoseconds(time: libc::timespec) -> i64 {
    time.tv_sec
        .saturating_mul(1_000_000_000)
        .saturating_add(time.tv_nsec)
}

/// A new non-blocking raw CAN socket, not bound to an interface yet.
pub(super) fn can_socket() -> Result<OwnedFd, Errno> {
    let kind = libc::SOCK_RAW | libc::SOCK_CLOEXEC | libc::SOCK_NONBLOCK;
    // SAFETY: no pointers involved.
    let fd = check(unsafe { libc::socket(libc::PF_CAN, kind, libc::CAN_RAW) })?;
    // SAFETY: the kernel just gave us this descriptor; nobody else owns it.
    Ok(unsafe { OwnedFd::from_raw_fd(fd) })
}

/// Binds a CAN socket to the interface with this index.
pub(super) fn bind_can(socket: BorrowedFd<'_>, interface: u32) -> Result<(), Errno> {
    let mut address = libc::sockaddr_can {
        can_family: CAN_FAMILY,
        ..Default::default()
    };
    address.can_ifindex = c_int::try_from(interface).map_err(|_| Errno::NODEV)?;
    // SAFETY: address is a sockaddr_can of the size given.
    check(unsafe {
        libc::bind(
            socket.as_raw_fd(),
            (&raw const address).cast(),
            SOCKADDR_CAN_SIZE,
        )
    })
    .map(drop)
}

/// Values that a socket option may have: plain data without padding.
pub(super) trait OptionValue: Copy {}
impl OptionValue for c_int {}
impl OptionValue for u32 {}
impl OptionValue for libc::can_filter {}

/// Sets an option whose value is an array of `T`.
pub(super) fn set_option<T: OptionValue>(
    socket: BorrowedFd<'_>,
    level: c_int,
    name: c_int,
    value: &[T],
) -> Result<(), Errno> {
    let size = libc::socklen_t::try_from(size_of_val(value)).map_err(|_| Errno::INVAL)?;
    // SAFETY: value is plain data of the size given; the kernel only reads it.
    check(unsafe { libc::setsockopt(socket.as_raw_fd(), level, name, value.as_ptr().cast(), size) })
        .map(drop)
}

/// Lets only those datagrams in that the classic BPF program accepts.
pub(super) fn attach_filter(
    socket: BorrowedFd<'_>,
    program: &[libc::sock_filter],
) -> Result<(), Errno> {
    let len = u16::try_from(program.len()).map_err(|_| Errno::INVAL)?;
    let program = libc::sock_fprog {
        len,
        filter: program.as_ptr().cast_mut(),
    };
    let option = (libc::SOL_SOCKET, libc::SO_ATTACH_FILTER);
    // SAFETY: program points at len instructions, which the kernel copies and checks; it does not write to them.
    check(unsafe {
        libc::setsockopt(
            socket.as_raw_fd(),
            option.0,
            option.1,
            (&raw const program).cast(),
            SOCK_FPROG_SIZE,
        )
    })
    .map(drop)
}

/// Whether the network interface is switched on; any CAN socket can ask.
pub(super) fn interface_is_up(socket: BorrowedFd<'_>, name: &str) -> Result<bool, Errno> {
    // SAFETY: all-zero is a valid ifreq.
    let mut request: libc::ifreq = unsafe { std::mem::zeroed() };
    for (to, from) in request
        .ifr_name
        .iter_mut()
        .take(libc::IFNAMSIZ - 1)
        .zip(name.bytes())
    {
        *to = from.cast_signed();
    }
    // SAFETY: request is an ifreq with a terminated name, as SIOCGIFFLAGS reads and writes.
    check(unsafe {
        libc::ioctl(
            socket.as_raw_fd(),
            libc::SIOCGIFFLAGS as _,
            &raw mut request,
        )
    })?;
    // SAFETY: SIOCGIFFLAGS has just written ifru_flags.
    let flags = c_int::from(unsafe { request.ifr_ifru.ifru_flags });
    Ok(flags & libc::IFF_UP != 0)
}

fn check(result: c_int) -> Result<c_int, Errno> {
    if result < 0 {
        Err(last_error())
    } else {
        Ok(result)
    }
}

fn last_error() -> Errno {
    Errno::from_io_error(&std::io::Error::last_os_error()).unwrap_or(Errno::IO)
}
