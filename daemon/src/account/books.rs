//! The end of every tick: its latency, the heartbeat, and once a second the books, which go to telemetry.

use super::Ledger;
use crate::event::Link;

const PERIOD_NS: i64 = 1_000_000_000;

/// Of the second that runs.
#[derive(Debug, Default)]
pub(super) struct Books {
    ledger: Box<Ledger>,
    next_ns: i64,
    /// Ticks since the start.
    pub(super) tick: u64,
}

impl Books {
    /// Whether the next tick that is closed at `now_ns` closes the books of a second.
    pub(super) fn are_due(&self, now_ns: i64) -> bool {
        now_ns >= self.next_ns
    }

    /// Closes the tick; once a second, the ledger to be handed on.
    pub(super) fn close(
        &mut self,
        now_ns: i64,
        latency_ns: u64,
        link: &Link,
    ) -> Option<Box<Ledger>> {
        self.ledger.record(latency_ns);
        self.tick += 1;
        link.beat(self.tick);
        if !self.are_due(now_ns) {
            return None;
        }
        self.next_ns = now_ns + PERIOD_NS;
        self.swap(link)
    }

    /// While telemetry has no ledger to give back, or too much to do, this one goes on.
    fn swap(&mut self, link: &Link) -> Option<Box<Ledger>> {
        if link.is_full() {
            return None;
        }
        let spare = link.take_spare()?;
        Some(std::mem::replace(&mut self.ledger, spare))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Event;

    #[test]
    fn a_full_ring_loses_no_latency() {
        let (mut books, link) = (Books::default(), Link::new());
        while link.tell(Event::Lost { events: 1 }).is_ok() {}
        assert!(books.close(1, 100, &link).is_none());
        while link.next_event().is_some() {}
        assert!(books.close(PERIOD_NS, 150, &link).is_none(), "too early");
        let ledger = books.close(1 + PERIOD_NS, 200, &link);
        let percentiles = ledger.expect("a second has passed").percentiles();
        assert!(percentiles.max_ns >= 199);
        let median_ns = percentiles.p50_ns;
        assert!(
            (149..=152).contains(&median_ns),
            "{median_ns}: not the first"
        );
    }

    #[test]
    fn without_a_ledger_in_return_the_old_one_goes_on() {
        let (mut books, link) = (Books::default(), Link::new());
        let handed = [0, 1, 2].map(|second| books.close(second * PERIOD_NS, 100, &link).is_some());
        assert_eq!(handed, [true, false, false]);
        assert_eq!((books.tick, link.last_beat()), (3, 3));
        assert!(link.take_spare().is_none());
    }
}
