//! How events read in the log.

use tracing::{debug, info, warn};

use super::throttle::Sum;
use crate::clock::ClockStep;
use crate::event::Event;
use coloc_shm_types::{BeliefState, Health};

/// One line for one event, or for several that were added up.
pub(super) fn write((count, event): Sum) {
    let count = (count > 1).then_some(count);
    match event {
        Event::Rejected {
            input,
            source,
            reason,
            gated,
        } => {
            let (d2, gate) = gated.map(|it| (it.d2, it.gate)).unzip();
            warn!(count, source, d2, gate, "{input} rejected: {reason}");
        }
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
        Event::State {
            from,
            to: to @ BeliefState::Ok,
            tick,
        } => info!(count, tick, "belief: {from} -> {to}"),
        Event::State { from, to, tick } => {
            warn!(count, tick, "belief: {from} -> {to}: {}", meaning(to));
        }
        Event::Bus { from, to } => warn!(count, "can: {from} -> {to}"),
        Event::Contested { input, state } if state.contested => warn!(
            count,
            "{input}: {} senders say that they are source {}; give each a number of its own, or stop those that should not run",
            state.live,
            state.number
        ),
        Event::Contested { input, state } => {
            info!(
                count,
                "{input}: no more than one sender says that it is source {}", state.number
            );
        }
        Event::Missed {
            deadlines,
            lateness_ns,
        } => warn!(
            count,
            deadlines,
            lateness_ms = lateness_ns / 1_000_000,
            "deadline missed"
        ),
        Event::ClockStepped(ClockStep { clock, by_ns }) => warn!(
            count,
            by_ns, "somebody set the clock {clock:?}; the pose goes on, stamps are converted anew"
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

/// What a state that is not good means to the person who reads of it.
fn meaning(state: BeliefState) -> &'static str {
    match state {
        BeliefState::Ok => "the robot knows where it is",
        BeliefState::Finding => "without wheels it does not know where it is",
        BeliefState::Contradicted => {
            "what it measures is beyond the gate again and again; see the lines of refused inputs for who and by how much, \
             and whether [initial] is where it stands"
        }
        BeliefState::Lost => "it does not know where it is",
    }
}
