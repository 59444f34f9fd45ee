//! What the team's rounds do to this robot, and when their slots begin.

use coloc_estimator::{Covariance3, Deed, Measurement, Origin, RoundWord, Span, Stamp};
use coloc_shm_types::{Correction, Input, Limits, PortError, Reject, RobotName, Sessions, Space};

use super::list::List;
use super::messages::{not_a_covariance, origin, pose, stamp};
use super::port::Port;
use crate::account::Account;
use crate::clock::Moment;
use crate::config;

/// A tick takes in so many messages at most; the others wait in shared memory for the next one.
const CORRECTIONS: usize = 8;
/// So many of all kinds.
pub(super) const MOST: usize = CORRECTIONS + 1;

/// A slot is shared once the wheels have said how the robot moved up to it, and so long after it began whatever they say \[ns\].
const SETTLED_NS: i64 = 20_000_000;

/// A clock that is behind by more slots was set back.
const SET_BACK: i64 = 2;

/// The subscriber of a robot that may make rounds, and its slots.
#[derive(Debug)]
pub(super) struct Rounds {
    words: Port<Correction>,
    period_ns: i64,
    /// Of the last slot that was shared.
    slot: Option<i64>,
}

impl Rounds {
    /// Subscribes to the channel of `name`.
    pub(super) fn open(
        space: &Space,
        name: &RobotName,
        config: &config::Rounds,
    ) -> Result<Self, PortError> {
        Ok(Self {
            words: Port::open(
                space,
                name,
                (Input::Correction, Sessions::SENSORS, CORRECTIONS),
            )?,
            period_ns: config.period_ns(),
            slot: None,
        })
    }

    pub(super) fn deaf(&self) -> Option<Input> {
        self.words.deaf()
    }

    pub(super) fn tell_sessions(&self, now: Stamp, account: &mut Account) {
        self.words.tell_sessions(now, account);
    }

    pub(super) fn receive(
        &mut self,
        moment: &Moment,
        limits: &Limits<'_>,
        into: &mut List<Measurement>,
        account: &mut Account,
    ) {
        self.words
            .drain(moment, into, account, |it| word(it, limits));
    }

    /// The slot that has begun and is not shared yet; `ahead`: how far the team's clock is ahead of the stamps; `reached`: up to which stamp
    /// the wheels have said how the robot moved.
    pub(super) fn begin(
        &mut self,
        now: Stamp,
        ahead: Span,
        reached: Stamp,
        into: &mut List<Measurement>,
    ) {
        let slot = settled((now + ahead, reached + ahead), self.period_ns);
        let is_new = self
            .slot
            .is_none_or(|last| slot > last || slot + SET_BACK < last);
        let Ok(number) = u64::try_from(slot) else {
            return; // Before the clock's beginning.
        };
        if !is_new {
            return;
        }
        self.slot = Some(slot);
        let stamp = Stamp::from_nanos(slot.saturating_mul(self.period_ns)) - ahead;
        // There is room for one a tick.
        let _ = into.push(Measurement::Round(RoundWord {
            stamp,
            origin: Origin::default(),
            deed: Deed::Share(number),
            of: None,
        }));
    }

    pub(super) fn clear(&mut self) {
        self.words.clear();
    }
}

/// The newest slot that may be shared at a moment of the common clock, when the wheels have reached another one.
fn settled((now, reached): (Stamp, Stamp), period_ns: i64) -> i64 {
    let begun = now.as_nanos().div_euclid(period_ns);
    let begun_ns = begun.saturating_mul(period_ns);
    let is_settled =
        reached.as_nanos() >= begun_ns || now.as_nanos().saturating_sub(begun_ns) >= SETTLED_NS;
    begun.saturating_sub(i64::from(!is_settled))
}

/// A word as the estimator takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub(super) fn word(message: &Correction, limits: &Limits<'_>) -> Result<Measurement, Reject> {
    message.validate(limits)?;
    let covariance = Covariance3::from_row_major(message.covariance).map_err(not_a_covariance)?;
    let deed = match message.kind {
        Correction::CORRECT => Deed::Correct {
            slot: message.slot,
            pose: pose(message.pose),
            covariance,
            factor: message.factor,
        },
        Correction::UNDO => Deed::Undo(Some(message.slot)),
        Correction::UNDO_ALL => Deed::Undo(None),
        Correction::JOIN => Deed::Join,
        _ => Deed::Leave,
    };
    Ok(Measurement::Round(RoundWord {
        stamp: stamp(message),
        origin: origin(message),
        deed,
        of: None,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_shared_once_the_wheels_have_reached_it_and_at_the_latest_after_a_tick() {
        let at = |now_ms: i64, reached_ms: i64| {
            let stamps = [now_ms, reached_ms].map(|it| Stamp::from_nanos(1_000_000 * it));
            settled(stamps.into(), 200_000_000)
        };
        assert_eq!(at(599, 599), 2);
        assert_eq!(at(600, 600), 3);
        assert_eq!([at(600, 599), at(619, 599)], [2, 2]);
        assert_eq!(at(610, 601), 3);
        assert_eq!(at(620, 0), 3);
        assert_eq!(at(-1, -1), -1);
    }
}
