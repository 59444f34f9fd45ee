//! A reader's side.
use std::cell::{Cell, OnceCell};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::fd::{AsFd, BorrowedFd};
use rustix::io::Errno;

use super::alarm::Alarm;
use super::door;
use super::error::ReadError;
use super::found::{Found, Site};
use super::page::View;
use crate::private::own_user;
use crate::{Estimate, Message, RobotName};

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
    alarm: OnceCell<Alarm>,
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
            alarm: OnceCell::new(),
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
        let (estimate, alarm) = (self.look(), self.alarm.get());
        let (None, Some(alarm)) = (estimate, alarm) else {
            return Ok(estimate);
        };
        let heard = alarm.hear();
        match self.look() {
            None => heard.map(|()| None).map_err(|error| self.unheard(error)),
            estimate => Ok(estimate),
        }
    }

    /// The same, asleep until there is one; `None` if none came for as long as `timeout`, or a signal was handled.
    ///
    /// # Errors
    /// As [`Self::receive`].
    pub fn wait(&self, timeout: Duration) -> Result<Option<Estimate>, ReadError> {
        let alarm = self.alarm()?;
        let start = Instant::now();
        loop {
            if let Some(estimate) = self.receive()? {
                return Ok(Some(estimate));
            }
            match alarm.sleep(timeout.saturating_sub(start.elapsed())) {
                Ok(true) => {}
                Ok(false) | Err(Errno::INTR) => return self.receive(),
                Err(error) => return Err(self.unheard(error)),
            }
        }
    }

    /// What is readable when there is an estimate, for `poll`, `epoll` and runtimes, level- or edge-triggered, as that of a
    /// [`Subscriber`](crate::Subscriber::bell); and when the robot has ended. It is to be waited on, never read from. Until this
    /// reader [has a place](Self::has_place) it is readable every 2 ms, so that [`Self::receive`] may find nothing.
    ///
    /// # Errors
    /// If the robot has ended.
    pub fn bell(&self) -> Result<BorrowedFd<'_>, ReadError> {
        self.alarm().map(Alarm::as_fd)
    }

    /// Whether the robot wakes this reader, as far as it has heard while it waited or received. Else there is no place for it: then
    /// it looks every 2 ms, and has one as soon as there is.
    #[must_use]
    pub fn has_place(&self) -> bool {
        self.alarm.get().is_some_and(Alarm::is_let_in)
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

    fn alarm(&self) -> Result<&Alarm, ReadError> {
        if let Some(alarm) = self.alarm.get() {
            return Ok(alarm);
        }
        let alarm = Alarm::new(&self.door).map_err(|error| self.unheard(error))?;
        Ok(self.alarm.get_or_init(|| alarm))
    }

    fn gone(&self) -> ReadError {
        ReadError::Gone {
            robot: self.robot.clone(),
        }
    }

    fn unheard(&self, error: Errno) -> ReadError {
        if matches!(error, Errno::CONNREFUSED | Errno::NOENT) {
            return self.gone();
        }
        ReadError::System {
            action: "wait for",
            robot: self.robot.clone(),
            source: error.into(),
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
