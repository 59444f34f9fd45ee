//! Who has been heard on a channel, and which of their messages.
//!
//! A session is one start of one sender; its number is random. Whatever a message claims, it mutes nobody: a session that was
//! never heard is another one beside those that live. None ends before it was silent for long, but where a fifth one of its source
//! needs its place. Of several that live at
//! once under one source, none can be believed more than another; that they are several is to be said.

mod session;
mod source;
mod window;

use crate::{Header, Reject};
use source::Source;

/// What has been heard on one channel, by source: keep one of these for each subscriber.
///
/// * Of a session, the last 128 numbers are told apart: each passes once. A message too far behind or ahead of that (2²⁰) is
///   of another count under the same number, which lives beside the first one.
/// * A session ends when it was silent for five of its own intervals, at least for a second and at most for five minutes. A
///   source has up to four that live; another one takes the place of that which was silent for longest, in its own intervals.
/// * What came twice all the same, because its session had been forgotten, is a duplicate to the estimator's history.
///
/// All times are of one clock that never steps (ns). Nothing is allocated after [`Self::new`].
#[derive(Clone, Debug)]
pub struct Sessions {
    sources: Vec<Source>,
    capacity: usize,
}

/// How one source is doing.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct SourceState {
    /// Its number: which sensor, or which robot.
    pub number: u16,
    /// How many of its sessions live.
    pub live: u8,
    /// Whether several senders claim it: their messages alternate for longer than a restart explains.
    pub contested: bool,
    /// Messages that are missing in its counts. It becomes less when they come late.
    pub lost: u64,
}

impl Sessions {
    /// Sensors of one kind that one robot may have.
    pub const SENSORS: usize = 16;

    /// Room for so many sources at once.
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        Self {
            sources: Vec::with_capacity(capacity),
            capacity,
        }
    }

    /// Notes a message that has passed every check that can be made of it alone, and came at `now_ns`.
    ///
    /// # Errors
    /// [`Reject::Replayed`] if it was here before, [`Reject::TooManySources`] if there is no room for its source; nothing is
    /// noted then.
    pub fn accept(&mut self, header: &Header, now_ns: i64) -> Result<(), Reject> {
        let known = self.place(header.source);
        if let Some(source) = known.and_then(|place| self.sources.get_mut(place)) {
            return source.accept(header, now_ns);
        }
        let source = Source::beginning(header, now_ns);
        if self.sources.len() < self.capacity {
            self.sources.push(source);
            return Ok(());
        }
        let ended = self.sources.iter_mut().filter(|it| it.live(now_ns) == 0);
        let place = ended.min_by_key(|it| it.heard_ns());
        *place.ok_or(Reject::TooManySources)? = source;
        Ok(())
    }

    /// How the source with that number is doing. Who was never heard has none, nor who ended and gave way to another source.
    #[must_use]
    pub fn state(&self, number: u16, now_ns: i64) -> Option<SourceState> {
        let place = self.place(number)?;
        Some(self.sources.get(place)?.state(now_ns))
    }

    fn place(&self, number: u16) -> Option<usize> {
        self.sources.iter().position(|it| it.number() == number)
    }
}

#[cfg(test)]
mod tests;
