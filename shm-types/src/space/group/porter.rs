//! Who lets readers in and passes on the bell, on a thread of its own.
use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec, eventfd, poll};
use rustix::fd::OwnedFd;
use rustix::io::{Errno, Result};
use rustix::net::sockopt::{set_socket_send_buffer_size, socket_peercred};
use rustix::net::{SendFlags, Shutdown, SocketFlags, accept_with, send, shutdown};

use super::super::bells::Waiter;
use super::call::{Call, Watch};
use super::urgency::{self, Allowance};
use super::{READERS, READERS_OF_A_USER};

/// At once or not at all, and without a signal.
const AT_ONCE: SendFlags = SendFlags::DONTWAIT.union(SendFlags::NOSIGNAL);
const BYTE: [u8; 1] = [0];

/// What is let in at a time, and how long nobody is after that: whoever comes again and again costs a percent of a processor.
const AT_A_TIME: usize = 4;
const REST: Duration = Duration::from_millis(4);

/// It calls nothing that is deep.
const STACK: usize = 64 << 10;

/// The thread; it ends when this is dropped.
#[derive(Debug)]
pub(super) struct Porter {
    stop: OwnedFd,
    call: Arc<Call>,
    thread: Option<JoinHandle<()>>,
}

impl Porter {
    pub(super) fn start(door: OwnedFd, bell: Waiter, call: Arc<Call>) -> std::io::Result<Self> {
        let stop = eventfd(0, EventfdFlags::CLOEXEC)?;
        let work = Work {
            call: call.clone(),
            watch: Watch::new(),
            allowance: Allowance::new(),
            stop: stop.try_clone()?,
            door,
            bell,
            readers: Vec::with_capacity(READERS),
            rests_until: None,
        };
        let thread = std::thread::Builder::new()
            .name("coloc-porter".into())
            .stack_size(STACK)
            .spawn(move || work.run())?;
        Ok(Self {
            stop,
            call,
            thread: Some(thread),
        })
    }
}

impl Porter {
    /// Makes it a real-time thread of this `priority`, for as long as it needs little of a processor.
    pub(super) fn hasten(&self, priority: u8) -> std::io::Result<()> {
        let Some(thread) = &self.thread else {
            return Ok(());
        };
        urgency::raise(thread, priority)?;
        self.call.is_urgent.store(true, Ordering::Relaxed);
        Ok(())
    }
}

impl Drop for Porter {
    fn drop(&mut self) {
        // The counter of a new eventfd has room for one.
        let _ = rustix::io::write(&self.stop, &1_u64.to_ne_bytes());
        if let Some(thread) = self.thread.take() {
            // It does not panic, and nobody could do anything about it here.
            let _ = thread.join();
        }
    }
}

struct Work {
    call: Arc<Call>,
    watch: Watch,
    allowance: Allowance,
    stop: OwnedFd,
    door: OwnedFd,
    bell: Waiter,
    readers: Vec<Connection>,
    rests_until: Option<Instant>,
}

/// A reader's.
struct Connection {
    socket: OwnedFd,
    user: u32,
    state: Cell<State>,
}

#[derive(Copy, Clone, PartialEq, Eq)]
enum State {
    /// To be rung for.
    Due,
    /// Was rung for, and may be again.
    Ready,
    /// Was rung for so often that no more fits in.
    Full,
    Gone,
}

/// What was found after a sleep.
#[derive(Default)]
struct Found {
    stop: bool,
    door: bool,
}

impl Work {
    fn run(mut self) {
        loop {
            self.allowance.keep_to(&self.call.is_urgent);
            match self.sleep() {
                Ok(Found { stop: true, .. }) => return,
                Ok(found) => self.serve(&found),
                Err(Errno::INTR) => {}
                // There is no memory now.
                Err(_) => std::thread::sleep(REST),
            }
        }
    }

    fn sleep(&mut self) -> Result<Found> {
        let rest = self.rest();
        let mut polled = Vec::with_capacity(4 + READERS);
        polled.push(PollFd::new(&self.stop, PollFlags::IN));
        let asked = |wanted: bool| {
            if wanted {
                PollFlags::IN
            } else {
                PollFlags::empty()
            }
        };
        // Nobody is rung for through a bell that is not armed; one ring may be left in it.
        let is_awaited = self.readers.iter().any(|it| it.is(State::Ready));
        polled.push(PollFd::new(&self.bell, asked(is_awaited)));
        polled.push(PollFd::new(&self.door, asked(rest.is_none())));
        polled.push(PollFd::new(&*self.call, PollFlags::IN));
        polled.extend(self.readers.iter().map(Connection::polled));
        self.watch.goes_to_sleep(&self.call, is_awaited);
        poll(&mut polled, rest.as_ref())?;
        let [_, bell, _, call, readers @ ..] = polled.as_slice() else {
            return Ok(Found::default());
        };
        // First of all: somebody is late by whatever is done before.
        if bell.revents().contains(PollFlags::IN) {
            self.pass_on();
        }
        let spent = if call.revents().contains(PollFlags::IN) {
            self.attend()
        } else {
            Duration::ZERO
        };
        for (reader, polled) in self.readers.iter().zip(readers) {
            reader.learn(polled.revents());
        }
        let is_readable = |at: usize| {
            let polled = polled.get(at);
            polled.is_some_and(|it| it.revents().contains(PollFlags::IN))
        };
        let found = Found {
            stop: is_readable(0),
            door: is_readable(2),
        };
        drop(polled);
        self.allowance.excuse(spent);
        Ok(found)
    }

    /// The next estimate rings again before readers look for this one: what comes in between is not lost. The ring that was heard
    /// is taken when it has been passed on.
    fn pass_on(&self) {
        self.bell.arm_again();
        self.ring_ready();
        self.bell.take_ring();
    }

    /// Awake for the next estimate: nobody need ring. For how long it has looked.
    fn attend(&self) -> Duration {
        self.bell.disarm();
        let (seen, spent) = self.watch.attend(&self.call, || self.ring_ready());
        self.bell.arm_again();
        if Watch::has_missed(&self.call, seen) {
            self.ring_ready();
        }
        spent
    }

    fn ring_ready(&self) {
        self.readers
            .iter()
            .filter(|it| it.is(State::Ready))
            .for_each(Connection::ring);
    }

    /// For how long nobody is let in.
    fn rest(&mut self) -> Option<Timespec> {
        let left = self.rests_until?.saturating_duration_since(Instant::now());
        if left.is_zero() {
            self.rests_until = None;
        }
        (!left.is_zero()).then(|| Timespec::try_from(left).ok())?
    }

    fn serve(&mut self, found: &Found) {
        self.readers.retain(|it| !it.is(State::Gone));
        if found.door {
            self.let_in();
        }
        self.ring();
    }

    fn ring(&self) {
        if !self.readers.iter().any(|it| it.is(State::Due)) {
            return;
        }
        // It may have rung since the sleep: that is for the others as well.
        let has_rung = self.bell.arm();
        let is_due = |it: &&Connection| it.is(State::Due) || has_rung && it.is(State::Ready);
        self.readers
            .iter()
            .filter(is_due)
            .for_each(Connection::ring);
    }

    fn let_in(&mut self) {
        self.rests_until = Some(Instant::now() + REST);
        for _ in 0..AT_A_TIME {
            let Ok(socket) = accept_with(&self.door, SocketFlags::CLOEXEC | SocketFlags::NONBLOCK)
            else {
                return;
            };
            if let Ok(reader) = Connection::new(socket) {
                self.seat(reader);
            }
        }
    }

    /// Who gets no place is turned away.
    fn seat(&mut self, reader: Connection) {
        let users: Vec<u32> = self.readers.iter().map(|it| it.user).collect();
        match place_for(reader.user, &users) {
            Place::Free => self.readers.push(reader),
            Place::Of(at) => {
                self.readers.remove(at);
                self.readers.push(reader);
            }
            Place::None => {}
        }
    }
}

#[derive(Debug, PartialEq, Eq)]
enum Place {
    Free,
    /// Its reader is shown out.
    Of(usize),
    None,
}

/// Where all places are taken, the user with most of them gives one to who has fewer, if that one then does not have more: so
/// nobody takes a place back, and no users together keep another one out. `users` are those of the places, the newest last.
fn place_for(user: u32, users: &[u32]) -> Place {
    let count = |user: u32| users.iter().filter(|it| **it == user).count();
    let own = count(user);
    if own >= READERS_OF_A_USER {
        return Place::None;
    }
    if users.len() < READERS {
        return Place::Free;
    }
    let places = users.iter().enumerate();
    let most = places.max_by_key(|(_, user)| count(**user));
    match most {
        Some((at, user)) if count(*user) > own + 1 => Place::Of(at),
        _ => Place::None,
    }
}

impl Connection {
    /// Nothing is ever read from it, and little fits in: the kernel makes more of a zero, some five rings.
    fn new(socket: OwnedFd) -> Result<Self> {
        let user = socket_peercred(&socket)?.uid.as_raw();
        shutdown(&socket, Shutdown::Read)?;
        set_socket_send_buffer_size(&socket, 0)?;
        Ok(Self {
            socket,
            user,
            state: Cell::new(State::Due),
        })
    }

    /// That it is gone is told unasked.
    fn polled(&self) -> PollFd<'_> {
        let asked = if self.is(State::Full) {
            PollFlags::OUT
        } else {
            PollFlags::empty()
        };
        PollFd::new(&self.socket, asked)
    }

    fn is(&self, state: State) -> bool {
        self.state.get() == state
    }

    fn learn(&self, found: PollFlags) {
        if found.intersects(PollFlags::HUP | PollFlags::ERR) {
            self.state.set(State::Gone);
        } else if found.contains(PollFlags::OUT) {
            self.state.set(State::Due);
        }
    }

    fn ring(&self) {
        self.state.set(match send(&self.socket, &BYTE, AT_ONCE) {
            // Where there is no memory now, the next one rings.
            Ok(_) | Err(Errno::NOBUFS | Errno::NOMEM | Errno::INTR) => State::Ready,
            Err(Errno::AGAIN) => State::Full,
            Err(_) => State::Gone,
        });
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixDatagram;

    use super::super::super::Space;
    use super::super::super::bells::{Page, Ringer};
    use super::*;

    /// A reader that is to be rung for, and its end.
    fn reader() -> (Connection, UnixDatagram) {
        let (ours, theirs) = UnixDatagram::pair().unwrap();
        theirs.set_nonblocking(true).unwrap();
        (Connection::new(ours.into()).unwrap(), theirs)
    }

    fn was_rung_for(reader: &UnixDatagram) -> bool {
        reader.recv(&mut [0]).is_ok()
    }

    /// The robot's thread is faster than the porter.
    #[test]
    fn who_comes_in_takes_nobody_elses_ring() {
        let root = tempfile::tempdir().unwrap();
        let space = Space::open(root.path(), "t", "test").unwrap();
        let page = || Page::open(space.place(), "0").unwrap();
        let ringer = Ringer::new(page()).unwrap();
        let (reader, sleeper) = self::reader();
        let mut work = Work {
            call: Arc::new(Call::new().unwrap()),
            watch: Watch::new(),
            allowance: Allowance::new(),
            stop: eventfd(0, EventfdFlags::CLOEXEC).unwrap(),
            door: eventfd(0, EventfdFlags::CLOEXEC).unwrap(),
            bell: Waiter::new(space.place(), page()).unwrap(),
            readers: vec![reader],
            rests_until: None,
        };
        work.serve(&Found::default());
        assert!(was_rung_for(&sleeper));
        ringer.ring(&space, || ());
        let (reader, newcomer) = self::reader();
        work.readers.push(reader);
        work.serve(&Found::default());
        assert!(was_rung_for(&newcomer));
        assert!(was_rung_for(&sleeper));
    }

    fn places(users: impl IntoIterator<Item = u32>) -> Vec<u32> {
        let users = users.into_iter();
        users.flat_map(|user| [user; READERS_OF_A_USER]).collect()
    }

    #[test]
    fn who_has_all_of_a_users_places_gets_no_more() {
        let mut users = places([1]);
        assert_eq!(place_for(1, &users), Place::None);
        assert_eq!(place_for(2, &users), Place::Free);
        users.pop();
        assert_eq!(place_for(1, &users), Place::Free);
    }

    /// That the porter does.
    fn come(user: u32, users: &mut Vec<u32>) -> Place {
        let place = place_for(user, users);
        if let Place::Of(at) = place {
            users.remove(at);
        }
        if place != Place::None {
            users.push(user);
        }
        place
    }

    #[test]
    fn who_has_most_gives_the_newest_and_does_not_get_it_back() {
        let mut users = places(1..=4);
        assert_eq!(come(5, &mut users), Place::Of(31), "the newest of 4");
        assert_eq!(come(5, &mut users), Place::Of(23), "the newest of 3");
        for user in 1..=4 {
            assert_eq!(come(user, &mut users), Place::None, "{user}");
        }
    }

    #[test]
    fn where_there_are_as_many_users_as_places_each_has_one() {
        let mut users = places(1..=4);
        for user in (5..=32).chain(5..=100) {
            come(user, &mut users);
        }
        users.sort_unstable();
        assert!(users.iter().copied().eq(1..=32));
    }
}
