//! One start of one sender.
use super::window::{Place, Window};
use crate::{Header, Rhythm};

/// A session is over after so many of its own intervals of silence …
const INTERVALS: i64 = 5;
/// … and not before that \[ns\].
const LEAST_PATIENCE_NS: i64 = 1_000_000_000;

/// What was heard of it.
#[derive(Copy, Clone, Debug)]
pub(super) struct Session {
    number: u64,
    window: Window,
    heard_ns: i64,
    /// Which message of its source was its last.
    order: u64,
    /// Of the messages as they came.
    rhythm: Rhythm,
}

impl Session {
    pub(super) fn beginning(header: &Header, now_ns: i64, order: u64) -> Self {
        Self {
            number: header.session,
            window: Window::beginning(header.sequence),
            heard_ns: now_ns,
            order,
            rhythm: Rhythm::default(),
        }
    }

    /// How far the message is from those of this session; `None` if it is of another one.
    pub(super) fn distance(&self, header: &Header) -> Option<u64> {
        let own = self.number == header.session;
        own.then(|| self.window.distance(header.sequence))?
    }

    /// Notes one that is not too far away; it is message `order` of its source.
    pub(super) fn note(&mut self, sequence: u64, now_ns: i64, order: u64) -> Place {
        let place = self.window.note(sequence);
        if place != Place::Seen {
            self.order = order;
            self.keep_time(now_ns);
        }
        place
    }

    /// What comes in one go says nothing about the interval.
    fn keep_time(&mut self, now_ns: i64) {
        let interval_ns = now_ns.saturating_sub(self.heard_ns);
        if interval_ns <= 0 {
            return;
        }
        self.heard_ns = now_ns;
        self.rhythm.note(interval_ns);
    }

    /// So long may it be silent before it counts as over \[ns\].
    pub(super) fn patience_ns(&self) -> i64 {
        let own_ns = self.rhythm.interval_ns() * INTERVALS;
        own_ns.max(LEAST_PATIENCE_NS)
    }

    pub(super) fn is_live(&self, now_ns: i64) -> bool {
        now_ns.saturating_sub(self.heard_ns) <= self.patience_ns()
    }

    /// For how long it was silent, as a part of what it may be.
    #[allow(clippy::cast_precision_loss)] // A comparison of what differs by much.
    pub(super) fn silence(&self, now_ns: i64) -> f64 {
        now_ns.saturating_sub(self.heard_ns) as f64 / self.patience_ns() as f64
    }

    pub(super) fn order(&self) -> u64 {
        self.order
    }

    pub(super) fn heard_ns(&self) -> i64 {
        self.heard_ns
    }
}
