//! Being asked to end.

use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use signal_hook::consts::{SIGINT, SIGQUIT, SIGTERM};
use signal_hook::low_level::pipe;

/// A descriptor that becomes readable when the program is asked to end, and stays so.
#[derive(Debug)]
pub struct Stop {
    asked: UnixStream,
    /// Kept, so that the other end does not look closed.
    _told: UnixStream,
}

/// What ended a wait.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Woken {
    /// It was asked to end.
    Stop,
    /// There is something to read, or the other side is gone.
    Ready,
    /// The time is over.
    Timeout,
}

impl Stop {
    /// From now on SIGTERM, SIGINT and SIGQUIT ask.
    ///
    /// # Errors
    /// If the system has no sockets left.
    pub fn on_signals() -> io::Result<Self> {
        let (stop, told) = Self::by_hand()?;
        for signal in [SIGTERM, SIGINT, SIGQUIT] {
            pipe::register(signal, told.try_clone()?)?;
        }
        Ok(stop)
    }

    /// Whoever writes to the stream asks.
    ///
    /// # Errors
    /// If the system has no sockets left.
    pub fn by_hand() -> io::Result<(Self, UnixStream)> {
        let (asked, told) = UnixStream::pair()?;
        let stop = Self {
            asked,
            _told: told.try_clone()?,
        };
        Ok((stop, told))
    }

    /// Sleeps until it is asked to end, `source` is readable, or `patience` is over.
    ///
    /// # Errors
    /// What the system says.
    pub fn wait(&self, source: Option<BorrowedFd<'_>>, patience: Duration) -> io::Result<Woken> {
        let mut asked = vec![PollFd::new(&self.asked, PollFlags::IN)];
        asked.extend(source.map(|source| PollFd::from_borrowed_fd(source, PollFlags::IN)));
        let patience = Timespec::try_from(patience).map_err(io::Error::other)?;
        match poll(&mut asked, Some(&patience)) {
            // A signal that is not ours, or is and is seen with the next look.
            Err(Errno::INTR) => Ok(Woken::Timeout),
            Err(error) => Err(error.into()),
            Ok(_) if !asked[0].revents().is_empty() => Ok(Woken::Stop),
            Ok(0) => Ok(Woken::Timeout),
            Ok(_) => Ok(Woken::Ready),
        }
    }

    /// Whether it was asked to end.
    #[must_use]
    pub fn is_asked(&self) -> bool {
        matches!(self.wait(None, Duration::ZERO), Ok(Woken::Stop))
    }
}

impl AsFd for Stop {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.asked.as_fd()
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn who_was_asked_once_stays_asked() {
        let (stop, mut told) = Stop::by_hand().unwrap();
        assert!(!stop.is_asked());
        told.write_all(b"!").unwrap();
        assert!(stop.is_asked() && stop.is_asked());
        let long = Duration::from_secs(1000);
        assert_eq!(stop.wait(None, long).unwrap(), Woken::Stop);
    }
}
