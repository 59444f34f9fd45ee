//! A CAN interface of the kernel.

use std::ffi::c_int;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

use rustix::io::Errno;
use rustix::net::netdevice;

use super::filter::Filter;
use super::health::BusState;
use super::room::{self, Limit};
use super::socket_bus::Endpoint;
use super::sys;

/// Everything that a raw socket on an interface needs, prepared once.
#[derive(Debug)]
pub(super) struct Interface {
    name: String,
    filters: Vec<libc::can_filter>,
}

impl Interface {
    pub(super) fn new(name: &str, filter: &Filter) -> Self {
        Self {
            name: name.to_owned(),
            filters: filter.kernel_filters(),
        }
    }
}

impl Endpoint for Interface {
    fn open(&self) -> Result<OwnedFd, Errno> {
        let socket = sys::can_socket()?;
        let fd = socket.as_fd();
        let index = netdevice::name_to_index(fd, &self.name)?;
        sys::set_option(fd, libc::SOL_CAN_RAW, libc::CAN_RAW_FILTER, &self.filters)?;
        sys::set_option(
            fd,
            libc::SOL_CAN_RAW,
            libc::CAN_RAW_ERR_FILTER,
            &[libc::CAN_ERR_MASK],
        )?;
        sys::set_option(fd, libc::SOL_CAN_RAW, libc::CAN_RAW_FD_FRAMES, &[ON])?;
        sys::set_option(fd, libc::SOL_SOCKET, libc::SO_TIMESTAMPNS, &[ON])?;
        sys::set_option(fd, libc::SOL_SOCKET, libc::SO_RXQ_OVFL, &[ON])?;
        sys::bind_can(fd, index).map_err(not_can)?;
        Ok(socket)
    }

    fn state(&self, socket: BorrowedFd<'_>) -> BusState {
        match sys::interface_is_up(socket, &self.name) {
            Ok(true) => BusState::Up,
            Ok(false) => BusState::Down,
            Err(_) => BusState::Gone,
        }
    }

    fn keep(&self, socket: BorrowedFd<'_>, frames: usize) -> Result<usize, Errno> {
        room::make(socket, frames)
    }

    const LIMIT: Limit = Limit::ReceiveBuffer;
}

/// A socket for sending only: it receives nothing and so never fills up.
pub(super) fn sending_socket(interface: &str) -> Result<OwnedFd, Errno> {
    let socket = sys::can_socket()?;
    let fd = socket.as_fd();
    let index = netdevice::name_to_index(fd, interface)?;
    sys::set_option::<libc::can_filter>(fd, libc::SOL_CAN_RAW, libc::CAN_RAW_FILTER, &[])?;
    sys::set_option(fd, libc::SOL_CAN_RAW, libc::CAN_RAW_FD_FRAMES, &[ON])?;
    sys::bind_can(fd, index).map_err(not_can)?;
    Ok(socket)
}

/// The interface is there, its index was just looked up; the kernel says `NODEV` when it is of another kind.
fn not_can(error: Errno) -> Errno {
    if error == Errno::NODEV {
        Errno::OPNOTSUPP
    } else {
        error
    }
}

pub(super) const ON: c_int = 1;
