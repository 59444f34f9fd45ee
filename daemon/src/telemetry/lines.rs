//! How events read in the log.

use tracing::{debug, info, warn};

use super::throttle::Sum;
use crate::event::Event;
use coloc_shm_types::Health;

/// One line for one event, or for several that were added up.
pub(super) fn write((count, event): Sum) {
    let count = (count > 1).then_some(count);
    match event {
        Event::Rejected { input, reason } => warn!(count, "{input} rejected: {reason}"),
        Event::Health {
            input,
            from,
            to: to @ Health::Ok,
            tick,
        } => info!(count, tick, "{input}: {from} -> {to}"),
        Event::Health {
            input,
            from,
            to,
            tick,
        } => warn!(count, tick, "{input}: {from} -> {to}"),
        Event::Bus { from, to } => warn!(count, "can: {from} -> {to}"),
        Event::Missed {
            deadlines,
            lateness_ns,
        } => warn!(count, deadlines, lateness_ns, "deadline missed"),
        Event::ClockStepped { shift_ns: 0 } => warn!(
            count,
            "the clock of the frame stamps was stepped; frames of this tick are stamped by their read"
        ),
        Event::ClockStepped { shift_ns } => warn!(
            count,
            shift_ns, "the clock was stepped; the belief goes on, the history was dropped"
        ),
        Event::NoRoom {
            overflowed,
            folded_early,
        } => {
            warn!(
                count,
                overflowed, folded_early, "the estimator ran out of room: raise history.capacity"
            );
        }
        Event::Lost { events } => {
            warn!(
                events,
                "telemetry could not keep up: these events are in no log or recording"
            );
        }
        other => debug!("{other:?}"),
    }
}
