//! A subscriber's side.
use std::cell::Cell;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::PathBuf;
use std::sync::atomic::{Ordering, fence};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{AtFlags, CWD, Mode};
use rustix::io::{Errno, Result};
use rustix::net::{RecvFlags, bind, recv};

use super::page::Page;
use super::{address, is_dead, path, ringer};
use crate::private::unguessable;
use crate::space::config::Place;

const PRIVATE: Mode = Mode::RUSR.union(Mode::WUSR);

/// A bell that is this process's. The order of the fields is that of leaving.
#[derive(Debug)]
pub(crate) struct Waiter {
    at: usize,
    number: u64,
    /// Armed since it was last heard: whoever has a message either rings, or has rung.
    armed: Cell<bool>,
    socket: OwnedFd,
    path: PathBuf,
    page: Page,
}

impl Waiter {
    /// Hangs it up. [`Errno::USERS`] if there is no place for another one.
    pub(crate) fn new(place: &Place, page: Page) -> Result<Self> {
        let number = unguessable().map_err(|_| Errno::IO)?.max(1);
        let (socket, path) = (bell(place, number)?, path(place, number));
        let mut waiter = Self {
            at: usize::MAX,
            number,
            armed: Cell::new(false),
            socket,
            path,
            page,
        };
        let page = &waiter.page;
        let at = page.take(number).or_else(|| {
            reclaim(place, page);
            page.take(number)
        });
        waiter.at = at.ok_or(Errno::USERS)?;
        Ok(waiter)
    }

    /// From now on a message rings that is not found by who looks after this. Whether that is new.
    pub(crate) fn arm(&self) -> bool {
        if self.armed.get() && !self.has_rung() {
            return false;
        }
        self.arm_again();
        true
    }

    /// For who was woken by a ring, and [takes](Self::take_ring) it after what is urgent.
    pub(crate) fn arm_again(&self) {
        self.page.slot(self.at).arm();
        self.armed.set(true);
        // Between the arming and the look that follows.
        fence(Ordering::SeqCst);
    }

    /// For who looks without being rung for.
    pub(crate) fn disarm(&self) {
        self.page.slot(self.at).disarm();
        self.armed.set(false);
    }

    /// If another one has come since, one is left, and wakes again.
    pub(crate) fn take_ring(&self) {
        self.has_rung();
    }

    /// Takes one ring, if there is one: who rang may not have disarmed it yet, so after it nothing is known.
    fn has_rung(&self) -> bool {
        let mut byte = [0_u8; 1];
        recv(&self.socket, &mut byte, RecvFlags::DONTWAIT).is_ok()
    }

    /// Sleeps until it rings, for as long; also until a signal was handled.
    pub(crate) fn sleep(&self, time: Duration) -> Result<bool> {
        // More seconds than the kernel counts are without end.
        let time = Timespec::try_from(time).ok();
        let mut waited = [PollFd::new(&self.socket, PollFlags::IN)];
        match poll(&mut waited, time.as_ref()) {
            Ok(count) => Ok(count > 0),
            Err(error) => Err(error),
        }
    }
}

impl AsFd for Waiter {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

impl Drop for Waiter {
    fn drop(&mut self) {
        if self.at != usize::MAX {
            let slot = self.page.slot(self.at);
            slot.disarm();
            slot.free(self.number);
        }
        // What cannot be removed is, with what the dead leave.
        let _ = rustix::fs::unlink(&self.path);
    }
}

fn bell(place: &Place, number: u64) -> Result<OwnedFd> {
    let socket = ringer::socket()?;
    // Before it has a name, so that nobody else ever finds it open; and after it, whatever the umask took.
    rustix::fs::fchmod(&socket, PRIVATE)?;
    bind(&socket, &address(place, number)?)?;
    rustix::fs::chmodat(CWD, path(place, number), PRIVATE, AtFlags::empty())?;
    Ok(socket)
}

/// Frees the slots of the dead.
fn reclaim(place: &Place, page: &Page) {
    for slot in page.slots() {
        let bell = slot.bell();
        let path = path(place, bell);
        if bell != 0 && (is_dead(&path) || !path.exists()) {
            slot.free(bell);
        }
    }
}
