//! Who takes part in the team's rounds: it fuses nothing of what others tell it, so it is told nothing.

use coloc_estimator::Stamp;
use coloc_shm_types::{Call, Message, PortError, RobotName, Space, Subscriber};
use tracing::warn;

use crate::config::Config;

/// Who has said nothing for so many slots is told again.
const SLOTS: i64 = 3;

/// More do not fit into the channel.
const MOST: usize = 16;

/// A peer that may make rounds.
#[derive(Debug)]
pub(super) struct Companion {
    calls: Subscriber<Call>,
    id: u16,
    period_ns: i64,
    /// The slot of its last word.
    newest: Option<i64>,
}

impl Companion {
    /// `None` where this robot makes no rounds, or has no place at the channel: then it tells as if the other made none.
    pub(super) fn open(
        space: &Space,
        (id, name): (u16, &RobotName),
        config: &Config,
    ) -> Result<Option<Self>, PortError> {
        if !config.makes_rounds() {
            return Ok(None);
        }
        match space.subscriber::<Call>(name) {
            Ok(calls) => Ok(Some(Self {
                calls,
                id,
                period_ns: config.rounds.period_ns(),
                newest: None,
            })),
            Err(problem @ PortError::Full { .. }) => {
                let channel = Call::CHANNEL.name();
                warn!("{name} is told where it is seen, whatever it says on {channel}: {problem}");
                Ok(None)
            }
            Err(problem) => Err(problem),
        }
    }

    /// Whether it takes part at `now` of the common clock.
    pub(super) fn is_here(&mut self, now: Stamp) -> bool {
        for _ in 0..MOST {
            let Ok(Some(call)) = self.calls.receive() else {
                break;
            };
            if call.kind == Call::HERE && call.header.source == self.id {
                self.newest = i64::try_from(call.slot).ok();
            }
        }
        let slot = now.as_nanos().div_euclid(self.period_ns);
        self.newest.is_some_and(|said| is_recent(said, slot))
    }
}

/// A slot that is not there yet is one of a clock that was set back.
fn is_recent(said: i64, slot: i64) -> bool {
    (said..=said.saturating_add(SLOTS)).contains(&slot) || said == slot.saturating_add(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_holds_for_three_slots() {
        let recent: Vec<i64> = (0..20).filter(|it| is_recent(10, *it)).collect();
        assert_eq!(recent, [9, 10, 11, 12, 13]);
        assert!(!is_recent(i64::MAX, 0));
    }
}
