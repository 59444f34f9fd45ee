//! Whether a message was here before.
use crate::{Header, Reject};

/// Messages behind the newest that are still told apart.
const WINDOW: u32 = u128::BITS;

/// What one sender has sent on one channel: keep one of these for each pair.
///
/// A sender that was restarted (a newer session) begins anew; what its earlier self still had under way is turned away,
/// and so is what lies further back than the last 128 sequence numbers: it cannot be told from a repetition.
#[derive(Copy, Clone, Debug, Default)]
pub struct Replay {
    newest: Option<Newest>,
}

/// The newest message so far, and which of those before it have been seen.
#[derive(Copy, Clone, Debug)]
struct Newest {
    session_ns: i64,
    sequence: u64,
    /// Bit k: sequence − k was seen.
    seen: u128,
}

impl Replay {
    /// Nothing seen yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { newest: None }
    }

    /// Records a message that has passed every other check.
    ///
    /// # Errors
    /// [`Reject::Replayed`] if it was here before or belongs to an earlier session; nothing is recorded then.
    pub fn accept(&mut self, header: &Header) -> Result<(), Reject> {
        let next = match self.newest {
            Some(newest) if header.session_ns < newest.session_ns => Err(Reject::Replayed),
            Some(newest) if header.session_ns == newest.session_ns => newest.with(header.sequence),
            _ => Ok(Newest::first(header)),
        }?;
        self.newest = Some(next);
        Ok(())
    }
}

impl Newest {
    fn first(header: &Header) -> Self {
        Self {
            session_ns: header.session_ns,
            sequence: header.sequence,
            seen: 1,
        }
    }

    fn with(self, sequence: u64) -> Result<Self, Reject> {
        match sequence.checked_sub(self.sequence) {
            Some(0) => Err(Reject::Replayed),
            Some(ahead) => Ok(self.moved_on(ahead)),
            None => self.filled_in(self.sequence - sequence),
        }
    }

    fn moved_on(self, ahead: u64) -> Self {
        let kept = u32::try_from(ahead)
            .ok()
            .and_then(|ahead| self.seen.checked_shl(ahead));
        Self {
            sequence: self.sequence + ahead,
            seen: kept.unwrap_or(0) | 1,
            ..self
        }
    }

    fn filled_in(self, behind: u64) -> Result<Self, Reject> {
        match u32::try_from(behind) {
            Ok(behind) if behind < WINDOW && self.seen & (1 << behind) == 0 => Ok(Self {
                seen: self.seen | 1 << behind,
                ..self
            }),
            _ => Err(Reject::Replayed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(session_ns: i64, sequence: u64) -> Header {
        Header {
            stamp_ns: 0,
            session_ns,
            sequence,
        }
    }

    #[test]
    fn a_message_passes_once() {
        let mut replay = Replay::new();
        assert_eq!(replay.accept(&message(1, 0)), Ok(()));
        assert_eq!(replay.accept(&message(1, 0)), Err(Reject::Replayed));
    }

    #[test]
    fn order_does_not_matter_within_the_window() {
        let mut replay = Replay::new();
        assert_eq!(replay.accept(&message(1, 127)), Ok(()));
        for sequence in (0..127).rev() {
            assert_eq!(replay.accept(&message(1, sequence)), Ok(()), "{sequence}");
        }
        for sequence in 0..128 {
            assert_eq!(
                replay.accept(&message(1, sequence)),
                Err(Reject::Replayed),
                "{sequence}"
            );
        }
    }

    #[test]
    fn what_is_behind_the_window_counts_as_seen() {
        let mut replay = Replay::new();
        assert_eq!(replay.accept(&message(1, 128)), Ok(()));
        assert_eq!(replay.accept(&message(1, 0)), Err(Reject::Replayed));
        assert_eq!(replay.accept(&message(1, 1)), Ok(()));
    }

    #[test]
    fn a_restarted_sender_begins_anew_and_silences_its_earlier_self() {
        let mut replay = Replay::new();
        assert_eq!(replay.accept(&message(1, 1000)), Ok(()));
        assert_eq!(replay.accept(&message(2, 0)), Ok(()));
        assert_eq!(replay.accept(&message(1, 1001)), Err(Reject::Replayed));
        assert_eq!(replay.accept(&message(2, 1)), Ok(()));
    }

    #[test]
    fn the_largest_leap_forgets_what_was_before() {
        let mut replay = Replay::new();
        assert_eq!(replay.accept(&message(i64::MIN, 0)), Ok(()));
        assert_eq!(replay.accept(&message(i64::MIN, u64::MAX)), Ok(()));
        assert_eq!(replay.accept(&message(i64::MIN, 0)), Err(Reject::Replayed));
        assert_eq!(replay.accept(&message(i64::MIN, u64::MAX - 1)), Ok(()));
    }

    proptest::proptest! {
        #![proptest_config(proptest::test_runner::Config {
            rng_seed: proptest::test_runner::RngSeed::Fixed(1), failure_persistence: None, ..Default::default()
        })]

        /// Against a set of everything seen: within the window, exactly the new ones pass.
        #[test]
        fn agrees_with_a_set(sequences in proptest::collection::vec(0_u64..400, 0..300)) {
            let mut replay = Replay::new();
            let mut seen = std::collections::BTreeSet::new();
            for sequence in sequences {
                let newest = seen.last().copied().unwrap_or(0);
                let expected = sequence + 128 > newest && seen.insert(sequence);
                proptest::prop_assert_eq!(replay.accept(&message(1, sequence)).is_ok(), expected);
            }
        }
    }
}
