//! What wakes a reader: the porter, or a clock for as long as that has not let it in.
use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, epoll, poll};
use rustix::fd::{AsFd, BorrowedFd, OwnedFd};
use rustix::io::{Errno, Result};
use rustix::net::{RecvFlags, recv};
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, timerfd_create, timerfd_settime,
};

use super::door;

/// Between the looks of who is not let in (ns).
const LOOK_NS: i64 = 2_000_000;
/// Who was turned away comes again after this.
const PAUSE: Duration = Duration::from_millis(100);

/// More rings than fit into a connection.
const RINGS: u32 = 64;

/// One descriptor for both, so that who waits for it need not know which it is.
#[derive(Debug)]
pub(super) struct Alarm {
    door: PathBuf,
    /// Readable when the line or the clock is.
    watch: OwnedFd,
    clock: OwnedFd,
    line: RefCell<Option<Line>>,
    knocks_from: Cell<Instant>,
}

/// To the porter.
#[derive(Debug)]
struct Line {
    socket: OwnedFd,
    state: Cell<State>,
}

#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum State {
    /// The porter has not come to it yet.
    Waits,
    /// Who is let in is rung for at once.
    LetIn,
    /// Turned away, or shown out, or the robot has ended.
    Ended,
}

impl Alarm {
    /// It knocks at once. `ECONNREFUSED` or `ENOENT` if nobody is behind the door.
    pub(super) fn new(door: &Path) -> Result<Self> {
        let watch = epoll::create(epoll::CreateFlags::CLOEXEC)?;
        let flags = TimerfdFlags::CLOEXEC | TimerfdFlags::NONBLOCK;
        let clock = timerfd_create(TimerfdClockId::Monotonic, flags)?;
        let alarm = Self {
            door: door.into(),
            watch,
            clock,
            line: RefCell::new(None),
            knocks_from: Cell::new(Instant::now()),
        };
        alarm.watch(&alarm.clock)?;
        alarm.set_clock(LOOK_NS)?;
        alarm.knock()?;
        Ok(alarm)
    }

    /// Takes all rings that there are: the next estimate rings again. Who is not let in knocks again.
    pub(super) fn hear(&self) -> Result<()> {
        let (before, now) = self.listen();
        match (before, now) {
            (State::LetIn, State::LetIn) => return Ok(()),
            (_, State::LetIn) => return self.set_clock(0),
            // The robot may have ended: that is found at once, or after the pause.
            (State::LetIn, State::Ended) => self.hang_up(Duration::ZERO)?,
            (State::Waits, State::Ended) => self.hang_up(PAUSE)?,
            _ => {}
        }
        // Nothing is to be read if it has not gone off.
        let _ = rustix::io::read(&self.clock, &mut [0_u8; 8]);
        self.knock()
    }

    /// Until it rings, or it is time to look: for as long. Also until a signal was handled.
    pub(super) fn sleep(&self, time: Duration) -> Result<bool> {
        // More seconds than the kernel counts are without end.
        let time = Timespec::try_from(time).ok();
        let line = self.line.borrow();
        let line = line.as_ref().filter(|it| it.state.get() == State::LetIn);
        let asked = line.map_or(&self.watch, |it| &it.socket);
        let mut asked = [PollFd::new(asked, PollFlags::IN)];
        poll(&mut asked, time.as_ref()).map(|count| count > 0)
    }

    pub(super) fn is_let_in(&self) -> bool {
        let line = self.line.borrow();
        line.as_ref()
            .is_some_and(|it| it.state.get() == State::LetIn)
    }

    /// What the line was, and what it is now.
    fn listen(&self) -> (State, State) {
        let line = self.line.borrow();
        let Some(line) = line.as_ref() else {
            return (State::Ended, State::Ended);
        };
        let before = line.state.get();
        line.hear();
        (before, line.state.get())
    }

    fn hang_up(&self, pause: Duration) -> Result<()> {
        self.line.replace(None);
        self.knocks_from.set(Instant::now() + pause);
        self.set_clock(LOOK_NS)
    }

    /// If it is time to.
    fn knock(&self) -> Result<()> {
        if self.line.borrow().is_some() || Instant::now() < self.knocks_from.get() {
            return Ok(());
        }
        match door::connected(&self.door) {
            Ok(socket) => self.take(socket),
            // Too many do: again at the next look.
            Err(Errno::AGAIN) => Ok(()),
            Err(error) => Err(error),
        }
    }

    fn take(&self, socket: OwnedFd) -> Result<()> {
        self.watch(&socket)?;
        self.line.replace(Some(Line {
            socket,
            state: Cell::new(State::Waits),
        }));
        Ok(())
    }

    fn watch(&self, what: &OwnedFd) -> Result<()> {
        let data = epoll::EventData::new_u64(0);
        epoll::add(&self.watch, what, data, epoll::EventFlags::IN)
    }

    /// 0 to stop it.
    fn set_clock(&self, period_ns: i64) -> Result<()> {
        let period = rustix::time::Timespec {
            tv_sec: 0,
            tv_nsec: period_ns,
        };
        let times = Itimerspec {
            it_interval: period,
            it_value: period,
        };
        timerfd_settime(&self.clock, TimerfdTimerFlags::empty(), &times).map(drop)
    }
}

impl AsFd for Alarm {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.watch.as_fd()
    }
}

impl Line {
    fn hear(&self) {
        let mut byte = [0_u8; 1];
        for _ in 0..RINGS {
            match recv(&self.socket, &mut byte, RecvFlags::DONTWAIT) {
                Ok((0, _)) => return self.state.set(State::Ended),
                Ok(_) => self.state.set(State::LetIn),
                Err(Errno::AGAIN | Errno::INTR) => return,
                Err(_) => return self.state.set(State::Ended),
            }
        }
    }
}
