//! What telemetry is told, and what was lost on the real-time thread.

use std::sync::Arc;

use coloc_estimator::TickOutputs;
use coloc_shm_types::{Losses, Timing};

use crate::event::{Event, Link};

/// Tells telemetry what it has room for.
#[derive(Debug)]
pub(super) struct Teller {
    pub(super) link: Arc<Link>,
    /// Since the start.
    pub(super) losses: Losses,
}

impl Teller {
    pub(super) fn new(link: Arc<Link>) -> Self {
        Self {
            link,
            losses: Losses::default(),
        }
    }

    /// Tells it, or counts that it could not be told.
    pub(super) fn tell(&mut self, event: Event) {
        if self.link.tell(event).is_err() {
            self.losses.events += 1;
        }
    }

    /// Tells where the time of a tick went, unless telemetry has so much to catch up with that lines of the log could be lost.
    pub(super) fn tell_timing(&mut self, timing: Timing) {
        if self.link.is_half_full() {
            self.losses.timings += 1;
        } else {
            self.tell(Event::Timing(timing));
        }
    }

    /// The estimator had no room for everything.
    pub(super) fn no_room(&mut self, outputs: &TickOutputs<'_>) {
        let (overflowed, folded_early) = (outputs.overflowed, outputs.folded_early);
        if overflowed > 0 || folded_early > 0 {
            self.losses.overflowed += u64::from(overflowed);
            self.losses.folded_early += u64::from(folded_early);
            self.tell(Event::NoRoom {
                overflowed,
                folded_early,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_ticks_leave_room_for_everything_else() {
        let link = Arc::new(Link::new());
        let mut teller = Teller::new(Arc::clone(&link));
        let capacity = Link::CAPACITY as u64;
        (0..capacity).for_each(|_| teller.tell_timing(Timing::default()));
        (0..capacity / 2).for_each(|events| teller.tell(Event::Lost { events }));
        let losses = teller.losses;
        assert_eq!((losses.timings, losses.events), (capacity / 2, 0));
        assert!(link.is_full());
        teller.tell(Event::Lost { events: 1 });
        assert_eq!(teller.losses.events, 1);
    }
}
