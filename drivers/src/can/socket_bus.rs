//! A bus behind a datagram socket: drained without blocking, watched, and opened again when it is lost.

use std::os::fd::{AsFd, BorrowedFd, IntoRawFd, OwnedFd};

use rustix::event::epoll;
use rustix::io::Errno;
use rustix::net::sockopt;

use crate::is_broken;

use super::backoff::Backoff;
use super::error_frame::ErrorCounters;
use super::filter::Filter;
use super::frame::{FD_SIZE, Frame, Kind};
use super::health::{BusHealth, BusState};
use super::received::{Drained, FRAMES_PER_CALL, Received};
use super::room::{Limit, Shortage};
use super::sys::{self, Datagram};

/// What a socket leads to, and how to open one.
pub(super) trait Endpoint {
    /// A new socket, bound, filtered and stamping. Must not allocate: it also runs on the real-time thread.
    fn open(&self) -> Result<OwnedFd, Errno>;
    /// How the place that `socket` leads to is doing: up, down or gone.
    fn state(&self, socket: BorrowedFd<'_>) -> BusState;
    /// Has `socket` keep so many frames while nobody takes them; how many it does. Must not allocate.
    fn keep(&self, socket: BorrowedFd<'_>, frames: usize) -> Result<usize, Errno>;
    /// What there is not enough of if those are fewer.
    const LIMIT: Limit;
}

/// A socket, or the place where one will be again.
#[derive(Debug)]
pub(super) struct SocketBus<E> {
    endpoint: E,
    /// Owners wait on this one: it stays the same when the socket behind it is replaced.
    epoll: OwnedFd,
    open: Option<Open>,
    /// How many frames are to be kept, if that was said.
    keep: Option<usize>,
    /// It has brought something since it was last looked after.
    heard: bool,
    backoff: Backoff,
    next_look_ns: i64,
}

#[derive(Debug)]
struct Open {
    socket: OwnedFd,
    /// The kernel's name for this very socket: a descriptor number may come to mean another one.
    cookie: u64,
    dropped: u32,
}

impl Open {
    fn is_ours(&self) -> bool {
        sockopt::socket_cookie(&self.socket) == Ok(self.cookie)
    }

    /// Closes the socket, unless somebody did: its number may be theirs by now, and is not ours to close.
    fn close(self) {
        if !self.is_ours() {
            let _ = self.socket.into_raw_fd();
        }
    }
}

/// How often a place that seems well is looked at.
const LOOK_INTERVAL_NS: i64 = 100_000_000;

impl<E: Endpoint> SocketBus<E> {
    /// Opens it; a place that is not there yet is waited for.
    pub(super) fn new(endpoint: E, health: &mut BusHealth) -> Result<Self, Errno> {
        let epoll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
        let mut bus = Self {
            endpoint,
            epoll,
            open: None,
            keep: None,
            heard: false,
            backoff: Backoff::default(),
            next_look_ns: 0,
        };
        match bus.open() {
            Ok(state) => health.state = state,
            Err(Errno::NODEV | Errno::NOENT) => health.state = BusState::Gone,
            Err(error) => return Err(error),
        }
        Ok(bus)
    }

    fn open(&mut self) -> Result<BusState, Errno> {
        let socket = self.endpoint.open()?;
        if let Some(frames) = self.keep {
            // It was said at the start what cannot be had.
            let _ = self.endpoint.keep(socket.as_fd(), frames);
        }
        let cookie = sockopt::socket_cookie(&socket)?;
        epoll::add(
            &self.epoll,
            &socket,
            epoll::EventData::new_u64(0),
            epoll::EventFlags::IN,
        )?;
        let state = self.endpoint.state(socket.as_fd());
        self.open = Some(Open {
            socket,
            cookie,
            dropped: 0,
        });
        Ok(state)
    }

    /// Keeps so many frames from now on, whichever socket is behind it; what is missing of that.
    pub(super) fn keep(&mut self, frames: usize) -> Option<Shortage> {
        self.keep = Some(frames);
        let socket = self.open.as_ref()?.socket.as_fd();
        let kept = self.endpoint.keep(socket, frames).unwrap_or(0);
        Shortage::of(frames, kept, E::LIMIT)
    }

    /// Hands on what has arrived, at most [`FRAMES_PER_CALL`] datagrams.
    pub(super) fn receive(
        &mut self,
        number: u8,
        filter: &Filter,
        health: &mut BusHealth,
        sink: &mut impl FnMut(&Received),
    ) -> Drained {
        let mut frames = 0;
        let mut hand_on = |frame: &Frame, stamp_ns, health: &mut BusHealth| {
            if accept(frame, filter, health) {
                sink(&Received {
                    frame: *frame,
                    stamp_ns,
                    bus: number,
                });
                frames += 1;
            }
        };
        let mut more = true;
        for _ in 0..FRAMES_PER_CALL / sys::BATCH {
            match self.receive_batch(health, &mut hand_on) {
                Ok(sys::BATCH) | Err(Errno::INTR) => continue,
                Ok(_) => {}
                Err(error) => self.note_failure(error, health),
            }
            more = false;
            break;
        }
        Drained { frames, more }
    }

    /// As many datagrams as one call brings; how many.
    fn receive_batch(
        &mut self,
        health: &mut BusHealth,
        hand_on: &mut impl FnMut(&Frame, i64, &mut BusHealth),
    ) -> Result<usize, Errno> {
        let open = self.open.as_mut().ok_or(Errno::AGAIN)?;
        let mut buffers = [[0; FD_SIZE]; sys::BATCH];
        let mut datagrams = [Datagram::default(); sys::BATCH];
        let count = sys::receive(open.socket.as_fd(), &mut buffers, &mut datagrams)?;
        self.heard = true;
        for (datagram, buffer) in datagrams.iter().zip(&buffers).take(count) {
            if let Some(dropped) = datagram.dropped {
                health.counters.receive_drops += u64::from(dropped.wrapping_sub(open.dropped));
                open.dropped = dropped;
            }
            // A datagram always carries a stamp, also an empty one; only a socket that was shut down has none.
            let stamp_ns = datagram.stamp_ns.ok_or(Errno::SHUTDOWN)?;
            let bytes = buffer.get(..datagram.len).filter(|_| !datagram.truncated);
            match bytes.and_then(|bytes| Frame::from_raw(bytes).ok()) {
                Some(frame) => hand_on(&frame, stamp_ns, health),
                None => health.counters.malformed += 1,
            }
        }
        Ok(count)
    }

    fn note_failure(&mut self, error: Errno, health: &mut BusHealth) {
        match error {
            Errno::AGAIN => {}
            Errno::NETDOWN => health.state = BusState::Down,
            Errno::NODEV | Errno::NXIO => self.lose(BusState::Gone, health),
            _ => self.lose(BusState::Closed, health),
        }
    }

    fn lose(&mut self, state: BusState, health: &mut BusHealth) {
        if let Some(open) = self.open.take() {
            open.close();
        }
        health.state = state;
    }

    /// Looks after the socket: notices that it is not ours any more or leads nowhere, and opens a new one when due.
    pub(super) fn supervise(&mut self, now_ns: i64, health: &mut BusHealth) {
        // What brings stamped datagrams is a socket of ours; a system call is spent on one that is silent only.
        let heard = std::mem::take(&mut self.heard);
        match &self.open {
            Some(open) if !heard && !open.is_ours() => self.lose(BusState::Closed, health),
            Some(_) => self.look(now_ns, health),
            None if is_broken("reopen") => {}
            None if self.backoff.is_due(now_ns) => self.reopen(now_ns, health),
            None => {}
        }
    }

    fn look(&mut self, now_ns: i64, health: &mut BusHealth) {
        let Some(open) = &self.open else { return };
        if health.state != BusState::Down && now_ns < self.next_look_ns {
            return;
        }
        self.next_look_ns = now_ns.saturating_add(LOOK_INTERVAL_NS);
        match (self.endpoint.state(open.socket.as_fd()), health.state) {
            (BusState::Gone, _) => self.lose(BusState::Gone, health),
            (BusState::Down, _) => health.state = BusState::Down,
            (_, BusState::Down) => health.state = BusState::Up,
            // What the controller said of itself stands until it says otherwise.
            _ => {}
        }
    }

    fn reopen(&mut self, now_ns: i64, health: &mut BusHealth) {
        health.counters.reopen_attempts += 1;
        if let Ok(state) = self.open() {
            self.backoff.reset();
            health.counters.reopened += 1;
            (health.state, health.controller) = (state, ErrorCounters::default());
        } else {
            self.backoff.failed(now_ns);
        }
    }
}

/// Accounts for a frame; whether it is to be handed on.
pub(super) fn accept(frame: &Frame, filter: &Filter, health: &mut BusHealth) -> bool {
    let wanted = filter.accepts(frame);
    match (frame.kind(), frame.error()) {
        (Kind::Error, Some(error)) => health.note_error(error),
        _ if wanted => health.note_frame(),
        _ => health.counters.unwanted += 1,
    }
    wanted
}

impl<E> Drop for SocketBus<E> {
    fn drop(&mut self) {
        if let Some(open) = self.open.take() {
            open.close();
        }
    }
}

impl<E> AsFd for SocketBus<E> {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.epoll.as_fd()
    }
}
