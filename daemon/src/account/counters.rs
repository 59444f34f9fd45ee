//! How many inputs of each kind changed the belief, and how many did not, by reason; each of the latter is told.

use coloc_shm_types::{AssistCounters, CanCounters, Input, Reject, Status};

use super::losses::Teller;
use crate::event::{Event, Gated};

/// Since the start.
#[derive(Debug, Default)]
pub(super) struct Counters {
    accepted: [u64; Input::COUNT],
    rejected: [[u64; Reject::PLACES]; Input::COUNT],
    /// Of the frames and messages that odometry is made of.
    pub(super) odometry: CanCounters,
    /// Of what leaders say.
    pub(super) assist: AssistCounters,
}

impl Counters {
    pub(super) fn accept(&mut self, input: Input, count: u64) {
        if let Some(total) = self.accepted.get_mut(input as usize) {
            *total += count;
        }
    }

    /// `gated`: how far it was off, if it was beyond a gate.
    pub(super) fn reject(
        &mut self,
        (input, source): (Input, u16),
        reason: Reject,
        gated: Option<Gated>,
        teller: &mut Teller,
    ) {
        let reasons = self.rejected.get_mut(input as usize);
        if let Some(count) = reasons.and_then(|it| it.get_mut(reason as usize)) {
            *count += 1;
        }
        teller.tell(Event::Rejected {
            input,
            source,
            reason,
            gated,
        });
    }

    pub(super) fn write_to(&self, status: &mut Status) {
        status.can = self.odometry;
        status.assist = self.assist;
        for (place, count) in status.accepted.iter_mut().zip(self.accepted) {
            *place = count;
        }
        for (place, counts) in status.rejected.iter_mut().zip(&self.rejected) {
            *place = *counts;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::event::Link;

    #[test]
    fn each_rejected_input_is_counted_under_its_reason_and_told_with_its_source() {
        let link = Arc::new(Link::new());
        let mut teller = Teller::new(Arc::clone(&link));
        let (mut counters, mut status) = (Counters::default(), Status::default());
        let gated = Some(Gated {
            d2: 70.0,
            gate: 9.0,
        });
        counters.accept(Input::Position, 3);
        counters.reject((Input::Position, 7), Reject::Gated, gated, &mut teller);
        counters.write_to(&mut status);
        assert_eq!(status.accepted_of(Input::Position), 3);
        assert_eq!(status.rejected_of(Input::Position, Reject::Gated), 1);
        let all: u64 = Input::ALL.map(|it| status.rejected_total(it)).iter().sum();
        assert_eq!(all, 1);
        let Some(Event::Rejected {
            source, gated: far, ..
        }) = link.next_event()
        else {
            panic!("it is told")
        };
        assert_eq!((source, far), (7, gated));
    }
}
