//! Who speaks: what the headers of one sender have in common, and their count.
use std::io;

use crate::clock::boot;
use crate::private::unguessable;
use crate::{Clock, Header};

/// Stamps the messages of one source on one channel.
///
/// Its session is drawn at random when it starts, so that a program that was restarted is told from its earlier self, and
/// from any other that claims the same source, whatever the clocks do.
#[derive(Debug, PartialEq, Eq)]
pub struct Sender {
    source: u16,
    clock: Clock,
    session: u64,
    boot: u64,
    sequence: u64,
}

impl Sender {
    /// Begins a session of `source`: which sensor of this kind it is (0 where there is one), or the team number of the robot
    /// that speaks. Its stamps will be of `clock`.
    ///
    /// # Errors
    /// If the operating system gives no random number.
    pub fn start(source: u16, clock: Clock) -> io::Result<Self> {
        Ok(Self {
            source,
            clock,
            session: unguessable()?,
            boot: boot(),
            sequence: 0,
        })
    }

    /// The same source in the same session, on another channel or to another robot: it counts for itself.
    #[must_use]
    pub const fn beside(&self) -> Self {
        Self {
            sequence: 0,
            ..*self
        }
    }

    /// The header of the next message, measured at `stamp_ns` (ns of this sender's clock).
    pub const fn header(&mut self, stamp_ns: i64) -> Header {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        Header {
            stamp_ns,
            session: self.session,
            sequence,
            boot: self.boot,
            source: self.source,
            clock: self.clock as u8,
            reserved: [0; 5],
        }
    }

    /// Of which clock its stamps are.
    #[must_use]
    pub const fn clock(&self) -> Clock {
        self.clock
    }

    /// Its random number.
    #[must_use]
    pub const fn session(&self) -> u64 {
        self.session
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_counted_and_say_who_and_by_which_clock() {
        let mut sender = Sender::start(7, Clock::Tai).unwrap();
        let [first, second] = [5, 6].map(|stamp_ns| sender.header(stamp_ns));
        assert_eq!((first.stamp_ns, first.sequence, first.source), (5, 0, 7));
        assert_eq!((second.stamp_ns, second.sequence), (6, 1));
        assert_eq!(second.clock(), Ok(Clock::Tai));
        assert_eq!((first.boot, first.session), (boot(), sender.session()));
    }

    #[test]
    fn a_restart_is_another_session_and_another_channel_is_not() {
        let mut first = Sender::start(1, Clock::Boottime).unwrap();
        let again = Sender::start(1, Clock::Boottime).unwrap();
        assert_ne!(first.session(), again.session());
        let _ = first.header(0);
        let header = first.beside().header(0);
        assert_eq!((header.session, header.sequence), (first.session(), 0));
    }
}
