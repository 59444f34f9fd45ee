//! A publisher's side.
use std::cell::RefCell;
use std::os::fd::OwnedFd;
use std::sync::OnceLock;
use std::sync::atomic::{Ordering, fence};

use rustix::io::{Errno, Result};
use rustix::net::{
    AddressFamily, SendFlags, SocketAddrUnix, SocketFlags, SocketType, connect, send, sendto,
    socket_with,
};

use super::page::{Armed, Page, Slot};
use super::{BELLS, address};
use crate::space::Space;

/// At once or not at all, and without a signal.
const AT_ONCE: SendFlags = SendFlags::DONTWAIT.union(SendFlags::NOSIGNAL);
const BYTE: [u8; 1] = [0];

/// Rings by a path, where there is no descriptor left for a socket that is connected: one for all of the process.
static SPARE: OnceLock<OwnedFd> = OnceLock::new();

#[derive(Debug)]
pub(crate) struct Ringer {
    page: Page,
    /// Of each slot.
    lines: RefCell<Vec<Line>>,
}

/// The way to a bell.
#[derive(Debug, Default)]
struct Line {
    bell: u64,
    socket: Option<OwnedFd>,
}

impl Ringer {
    pub(crate) fn new(page: Page) -> Result<Self> {
        if SPARE.get().is_none() {
            // Another thread may be faster.
            let _ = SPARE.set(socket()?);
        }
        Ok(Self {
            page,
            lines: RefCell::new((0..BELLS).map(|_| Line::default()).collect()),
        })
    }

    /// Rings for a message that is out. `welcome` gives a newcomer what it is to find.
    pub(crate) fn ring(&self, space: &Space, welcome: impl Fn()) {
        self.each_armed(|slot, line, armed| {
            if line.is_new(slot) {
                welcome();
            }
            line.ring(space, slot, armed);
        });
    }

    /// Rings for those who have come since, and may have got something.
    pub(crate) fn greet(&self, space: &Space) {
        self.each_armed(|slot, line, armed| {
            if line.is_new(slot) {
                line.ring(space, slot, armed);
            }
        });
    }

    fn each_armed(&self, mut answer: impl FnMut(&Slot, &mut Line, Armed)) {
        // Between the message and the look at the bells; the waiter has one between its arming and its look.
        fence(Ordering::SeqCst);
        let slots = self.page.slots();
        if slots.is_empty() {
            return;
        }
        for (slot, line) in slots.iter().zip(self.lines.borrow_mut().iter_mut()) {
            if let Some(armed) = slot.armed() {
                answer(slot, line, armed);
            }
        }
    }
}

impl Line {
    fn is_new(&self, slot: &Slot) -> bool {
        self.bell != slot.bell()
    }

    #[cold]
    fn ring(&mut self, space: &Space, slot: &Slot, armed: Armed) {
        let bell = slot.bell();
        if bell == 0 {
            return;
        }
        match self.try_ring(space, bell) {
            // If it is full, it has rung.
            Ok(()) | Err(Errno::AGAIN) => slot.rung(armed),
            Err(Errno::CONNREFUSED | Errno::NOENT) => {
                slot.rung(armed);
                slot.free(bell);
            }
            // There is no memory now: the next message rings it.
            Err(_) => {}
        }
    }

    fn try_ring(&mut self, space: &Space, bell: u64) -> Result<()> {
        if self.bell != bell || self.socket.is_none() {
            self.bell = bell;
            let address = address(space.place(), bell)?;
            self.socket = match connected(&address) {
                Ok(socket) => Some(socket),
                Err(Errno::MFILE | Errno::NFILE | Errno::NOMEM | Errno::NOBUFS) => {
                    return by_path(&address);
                }
                Err(error) => return Err(error),
            };
        }
        let socket = self.socket.as_ref().ok_or(Errno::NOTCONN)?;
        send(socket, &BYTE, AT_ONCE).map(drop)
    }
}

fn by_path(address: &SocketAddrUnix) -> Result<()> {
    let spare = SPARE.get().ok_or(Errno::MFILE)?;
    sendto(spare, &BYTE, AT_ONCE, address).map(drop)
}

pub(super) fn connected(address: &SocketAddrUnix) -> Result<OwnedFd> {
    let socket = socket()?;
    connect(&socket, address)?;
    Ok(socket)
}

pub(super) fn socket() -> Result<OwnedFd> {
    socket_with(
        AddressFamily::UNIX,
        SocketType::DGRAM,
        SocketFlags::CLOEXEC,
        None,
    )
}
