//! A reader's side.
use std::cell::{Cell, OnceCell};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::{AsFd, BorrowedFd, OwnedFd};
use rustix::io::Errno;
use rustix::net::{RecvFlags, recv};

use super::door;
use super::error::ReadError;
use super::found::{Found, Site};
use super::page::View;
use crate::private::own_user;
use crate::{Estimate, Message, RobotName};

/// As long as it is tried to come in while too many others want to.
const PATIENCE: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(5);

/// More rings than fit into a connection.
const RINGS: u32 = 64;

/// Reads the newest estimate of a robot, also as another user, if its user has opened it to a group: `group` in `[shm]` of its
/// `robot.toml`.
///
/// It neither writes to shared memory nor locks anything. Who comes after others have been woken gets the newest estimate, not those
/// before: for every one of them, be of the robot's user and use a [`Subscriber`](crate::Subscriber).
#[derive(Debug)]
pub struct Reader {
    robot: RobotName,
    view: View,
    /// Of the estimate that was received last.
    received: Cell<u64>,
    door: PathBuf,
    /// Once somebody wants to wait.
    line: OnceCell<Line>,
}

/// What the porter rings through.
#[derive(Debug)]
struct Line {
    socket: OwnedFd,
    /// It was let in: then it is rung for at once.
    rung: Cell<bool>,
    ended: Cell<bool>,
}

impl Reader {
    /// That of `robot`, whose `shm.root` is `root`.
    ///
    /// # Errors
    /// Each [`ReadError`] says what to do about it.
    pub fn open(root: &Path, robot: &RobotName) -> Result<Self, ReadError> {
        let site = Site::of(root).map_err(|error| unseen(root, robot, error))?;
        let pages = site.pages();
        let is_empty = pages.is_empty();
        match pages.into_iter().find(|page| page.robot == *robot) {
            Some(page) => Self::of(page),
            None if is_empty && site.owner != own_user() => Err(site.not_shared()),
            None => Err(not_there(site.root, robot)),
        }
    }

    fn of(page: Found) -> Result<Self, ReadError> {
        let view = page.view()?;
        let robot = page.robot;
        let theirs = view.about().map(|about| about.type_name);
        if theirs.as_deref() != Some(Estimate::TYPE_NAME) {
            return Err(ReadError::OtherType {
                robot,
                theirs: theirs.unwrap_or_else(|| "something else".into()),
                ours: Estimate::TYPE_NAME,
            });
        }
        Ok(Self {
            robot,
            view,
            received: Cell::new(0),
            door: page.door,
            line: OnceCell::new(),
        })
    }

    /// The newest estimate, whether it was received before or not. Its age says whether the robot lives. No system call.
    #[must_use]
    pub fn newest(&self) -> Option<Estimate> {
        self.view.newer_than(0).map(|(_, estimate)| estimate)
    }

    /// The newest estimate, if it was not received yet. After [`Self::wait`] or [`Self::bell`] it costs a system call to find nothing.
    ///
    /// # Errors
    /// If the robot has ended: after [`Self::wait`] or [`Self::bell`].
    pub fn receive(&self) -> Result<Option<Estimate>, ReadError> {
        let (estimate, line) = (self.look(), self.line.get());
        let (None, Some(line)) = (estimate, line) else {
            return Ok(estimate);
        };
        line.hear();
        match self.look() {
            None if self.has_gone(line) => Err(self.gone()),
            estimate => Ok(estimate),
        }
    }

    /// The same, asleep until there is one; `None` if none came for as long as `timeout`, or a signal was handled.
    ///
    /// # Errors
    /// As [`Self::receive`]; and if it is not let in.
    pub fn wait(&self, timeout: Duration) -> Result<Option<Estimate>, ReadError> {
        let line = self.line()?;
        let start = Instant::now();
        loop {
            if let Some(estimate) = self.receive()? {
                return Ok(Some(estimate));
            }
            if line.ended.get() {
                return Err(self.full());
            }
            // More seconds than the kernel counts are without end.
            let left = Timespec::try_from(timeout.saturating_sub(start.elapsed())).ok();
            let mut waited = [PollFd::new(&line.socket, PollFlags::IN)];
            match poll(&mut waited, left.as_ref()) {
                Ok(1..) => {}
                Ok(0) | Err(Errno::INTR) => return self.receive(),
                Err(error) => return Err(self.failed("wait for", error.into())),
            }
        }
    }

    /// What is readable when there is an estimate, for `poll`, `epoll` and runtimes, level- or edge-triggered, as that of a
    /// [`Subscriber`](crate::Subscriber::bell); and when the robot has ended. It is to be waited on, never read from.
    ///
    /// # Errors
    /// If it is not let in, or the robot has ended.
    pub fn bell(&self) -> Result<BorrowedFd<'_>, ReadError> {
        let line = self.line()?;
        match line.ended.get() {
            true if self.has_gone(line) => Err(self.gone()),
            true => Err(self.full()),
            false => Ok(line.socket.as_fd()),
        }
    }

    /// Whether the robot's process lives. A few system calls.
    ///
    /// # Errors
    /// If it does not: open another reader when it is there again.
    pub fn check(&self) -> Result<(), ReadError> {
        if door::is_dead(&self.door) {
            return Err(self.gone());
        }
        Ok(())
    }

    fn look(&self) -> Option<Estimate> {
        let (count, estimate) = self.view.newer_than(self.received.get())?;
        self.received.set(count);
        Some(estimate)
    }

    fn line(&self) -> Result<&Line, ReadError> {
        if let Some(line) = self.line.get() {
            return Ok(line);
        }
        let line = Line {
            socket: self.connect()?,
            rung: Cell::new(false),
            ended: Cell::new(false),
        };
        Ok(self.line.get_or_init(|| line))
    }

    fn connect(&self) -> Result<OwnedFd, ReadError> {
        let start = Instant::now();
        loop {
            match door::connected(&self.door) {
                Ok(socket) => return Ok(socket),
                Err(Errno::AGAIN) if start.elapsed() < PATIENCE => std::thread::sleep(PAUSE),
                Err(Errno::AGAIN) => return Err(self.full()),
                Err(Errno::CONNREFUSED | Errno::NOENT) => return Err(self.gone()),
                Err(error) => return Err(self.failed("wait for", error.into())),
            }
        }
    }

    /// Not so who was never let in.
    fn has_gone(&self, line: &Line) -> bool {
        line.ended.get() && (line.rung.get() || self.check().is_err())
    }

    fn gone(&self) -> ReadError {
        ReadError::Gone {
            robot: self.robot.clone(),
        }
    }

    fn full(&self) -> ReadError {
        ReadError::Full {
            robot: self.robot.clone(),
        }
    }

    fn failed(&self, action: &'static str, source: io::Error) -> ReadError {
        ReadError::System {
            action,
            robot: self.robot.clone(),
            source,
        }
    }
}

impl Line {
    /// Takes all rings that there are: the next estimate rings again.
    fn hear(&self) {
        let mut byte = [0_u8; 1];
        for _ in 0..RINGS {
            match recv(&self.socket, &mut byte, RecvFlags::DONTWAIT) {
                Ok((0, _)) => return self.ended.set(true),
                Ok(_) => self.rung.set(true),
                Err(Errno::AGAIN | Errno::INTR) => return,
                Err(_) => return self.ended.set(true),
            }
        }
    }
}

fn unseen(root: &Path, robot: &RobotName, error: io::Error) -> ReadError {
    if error.kind() == io::ErrorKind::NotFound {
        return not_there(root.into(), robot);
    }
    ReadError::System {
        action: "look for",
        robot: robot.clone(),
        source: error,
    }
}

fn not_there(root: PathBuf, robot: &RobotName) -> ReadError {
    ReadError::NotThere {
        robot: robot.clone(),
        root,
    }
}
