//! Alive counter and checksum: whether a frame is new and whole.

use crate::can::{Id, raw_id};
use crate::crc::crc8_j1850;
use crate::is_broken;
use crate::signal::SignalDecoder;

use super::reject::FrameReject;
use super::tolerance::ALIVE_MEMORY_PERIODS;

/// Checks the frames of one message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Guard {
    checksum_byte: Option<usize>,
    alive: Option<Alive>,
}

/// An alive counter that passed, for [`Guard::accept`].
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Passed {
    /// The count and its stamp, if there is a counter.
    seen: Option<(u64, i64)>,
    /// Frames missing before this one.
    pub(super) skipped: u64,
}

impl Guard {
    pub(super) fn new(alive: Option<SignalDecoder>, checksum_byte: Option<usize>) -> Self {
        Self {
            checksum_byte,
            alive: alive.map(Alive::new),
        }
    }

    /// Checks a payload; notes a repetition, changes nothing else.
    ///
    /// # Errors
    /// The first reason against it.
    pub(super) fn check(
        &mut self,
        id: Id,
        data: &[u8],
        stamp_ns: i64,
    ) -> Result<Passed, FrameReject> {
        if let Some(byte) = self.checksum_byte {
            check_crc(id, data, byte)?;
        }
        self.alive
            .as_mut()
            .map_or(Ok(Passed::default()), |alive| alive.check(data, stamp_ns))
    }

    /// The frame counts: the next one is measured against it.
    pub(super) fn accept(&mut self, passed: Passed) {
        if let (Some(alive), Some(seen)) = (&mut self.alive, passed.seen) {
            alive.accept(seen);
        }
    }
}

fn check_crc(id: Id, data: &[u8], byte: usize) -> Result<(), FrameReject> {
    let (covered, found) = data
        .get(..byte)
        .zip(data.get(byte))
        .ok_or(FrameReject::Short)?;
    if is_broken("checksum") || checksum(id, covered) == *found {
        Ok(())
    } else {
        Err(FrameReject::Checksum)
    }
}

/// CRC-8 SAE J1850 over the identifier, low byte first (standard two bytes, extended four), and `data`.
pub(super) fn checksum(id: Id, data: &[u8]) -> u8 {
    let id_bytes = if matches!(id, Id::Standard(_)) { 2 } else { 4 };
    let id = (raw_id(id) & libc::CAN_EFF_MASK).to_le_bytes();
    crc8_j1850(id.into_iter().take(id_bytes).chain(data.iter().copied()))
}

#[derive(Copy, Clone, Debug, PartialEq)]
struct Alive {
    signal: SignalDecoder,
    /// The first count, and how many there are: as the DBC file's range says, until another one is seen.
    first: u64,
    number: u64,
    last: Option<u64>,
    /// When the count that was last seen, new or repeated, was seen.
    last_ns: i64,
    /// Longest recent time between two frames that followed one another; frames of a backlog come in a burst.
    period_ns: Option<i64>,
}

impl Alive {
    fn new(signal: SignalDecoder) -> Self {
        let all = (0, 1 << signal.size().min(63));
        let said = |(lowest, highest)| {
            let first = u64::try_from(lowest).ok()?;
            Some((first, u64::try_from(highest - lowest + 1).ok()?))
        };
        let (first, number) = signal.raw_range().and_then(said).unwrap_or(all);
        Self {
            signal,
            first,
            number,
            last: None,
            last_ns: 0,
            period_ns: None,
        }
    }

    fn check(&mut self, data: &[u8], stamp_ns: i64) -> Result<Passed, FrameReject> {
        let count = self.signal.raw(data).ok_or(FrameReject::Short)?;
        let seen = Some((count, stamp_ns));
        if !(self.first..self.first.saturating_add(self.number)).contains(&count) {
            (self.first, self.number) = (0, 1 << self.signal.size().min(63));
        }
        let Some(last) = self.last else {
            return Ok(Passed { seen, skipped: 0 });
        };
        let ahead = self.ahead(last, count);
        if self.may_have_wrapped(stamp_ns) {
            // So many frames are missing that the count says nothing about the order.
            return Ok(Passed {
                seen,
                skipped: ahead.checked_sub(1).unwrap_or(self.number - 1),
            });
        }
        match ahead {
            0 => {
                self.last_ns = stamp_ns;
                Err(FrameReject::Repeated)
            }
            _ if ahead > self.half() && self.period_ns.is_some() => Err(FrameReject::OutOfOrder),
            _ => Ok(Passed {
                seen,
                skipped: ahead - 1,
            }),
        }
    }

    fn may_have_wrapped(&self, stamp_ns: i64) -> bool {
        let elapsed_ns = u64::try_from(stamp_ns.saturating_sub(self.last_ns)).unwrap_or(0);
        let period_ns = self
            .period_ns
            .and_then(|period_ns| u64::try_from(period_ns).ok());
        period_ns.is_some_and(|period_ns| {
            elapsed_ns > period_ns.saturating_mul(self.half().min(ALIVE_MEMORY_PERIODS))
        })
    }

    fn half(&self) -> u64 {
        self.number / 2
    }

    /// From one count on to another.
    fn ahead(&self, from: u64, to: u64) -> u64 {
        let number = i128::from(self.number.max(1));
        let ahead = (i128::from(to) - i128::from(from)).rem_euclid(number);
        u64::try_from(ahead).unwrap_or(0)
    }

    fn accept(&mut self, (count, stamp_ns): (u64, i64)) {
        let follows = self.last.is_some_and(|last| self.ahead(last, count) == 1);
        if follows {
            let interval_ns = stamp_ns.saturating_sub(self.last_ns);
            self.period_ns = Some(self.period_ns.map_or(interval_ns, |period_ns| {
                interval_ns.max(period_ns - period_ns / 8)
            }));
        }
        (self.last, self.last_ns) = (Some(count), stamp_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::StandardId;
    use crate::database::Database;

    fn guard() -> Guard {
        let database = Database::load(None).unwrap();
        let message = database.message("WheelLeft").unwrap();
        Guard::new(Some(database.signal(message, "Alive").unwrap()), None)
    }

    /// Feeds a frame with this count at this time; accepts it if it passes.
    fn feed(guard: &mut Guard, count: u8, ms: i64) -> Result<u64, FrameReject> {
        let id = StandardId::new(0x100).unwrap().into();
        let passed = guard.check(id, &[0, 0, 0, 0, count, 0], ms * 1_000_000)?;
        guard.accept(passed);
        Ok(passed.skipped)
    }

    #[test]
    fn counting_on_skipping_repeating_and_going_back() {
        let mut guard = guard();
        assert_eq!(feed(&mut guard, 14, 0), Ok(0));
        assert_eq!(feed(&mut guard, 15, 20), Ok(0));
        assert_eq!(feed(&mut guard, 15, 20), Err(FrameReject::Repeated));
        assert_eq!(feed(&mut guard, 0, 40), Ok(0));
        assert_eq!(feed(&mut guard, 3, 100), Ok(2));
        assert_eq!(feed(&mut guard, 2, 101), Err(FrameReject::OutOfOrder));
        assert_eq!(feed(&mut guard, 4, 120), Ok(0));
    }

    #[test]
    fn after_a_long_gap_any_count_is_news() {
        for count in 0..16 {
            let mut guard = guard();
            feed(&mut guard, 0, 0).unwrap();
            feed(&mut guard, 1, 20).unwrap();
            assert!(feed(&mut guard, count, 1000).is_ok(), "count {count}");
        }
    }

    fn wide(bits: u64) -> Guard {
        counting(bits, "[0|0]")
    }

    fn counting(bits: u64, range: &str) -> Guard {
        let signal =
            format!("BU_: A\n\nBO_ 256 M: 8 A\n SG_ S : 0|{bits}@1+ (1,0) {range} \"\" A\n");
        let dbc = can_dbc::Dbc::try_from(signal.as_str()).unwrap();
        let signal = SignalDecoder::compile(&dbc.messages[0].signals[0], 8, None).unwrap();
        Guard::new(Some(signal), None)
    }

    fn feed_wide(guard: &mut Guard, count: u64, ms: i64) -> Result<u64, FrameReject> {
        let id = StandardId::new(0x100).unwrap().into();
        let passed = guard.check(id, &count.to_le_bytes(), ms * 1_000_000)?;
        guard.accept(passed);
        Ok(passed.skipped)
    }

    #[test]
    fn a_counter_of_any_width_wraps_at_its_own() {
        for bits in [1, 2, 7, 16, 31, 32, 33, 63, 64] {
            let (mut guard, top) = (wide(bits), u64::MAX >> (64 - bits));
            let mut feed = |count: u64, ms| feed_wide(&mut guard, count & top, ms);
            assert_eq!(feed(top - 1, 0), Ok(0), "{bits} bits");
            for step in 0..9 {
                assert_eq!(
                    feed(top.wrapping_add(step), 20 + 20 * step.cast_signed()),
                    Ok(0),
                    "{bits} bits"
                );
            }
        }
    }

    /// AUTOSAR's counters leave out the last count; others begin at one, or count to ten in a byte.
    #[test]
    fn a_counter_that_does_not_use_all_its_bits_counts_by_its_range() {
        for (bits, range, first, last) in [
            (4, "[0|14]", 0, 14),
            (8, "[0|9]", 0, 9),
            (4, "[1|15]", 1, 15),
        ] {
            let mut guard = counting(bits, range);
            for (count, frame) in (first..=last).cycle().zip(0..200) {
                assert_eq!(
                    feed_wide(&mut guard, count, 20 * frame),
                    Ok(0),
                    "{range}, frame {frame}"
                );
            }
        }
    }

    /// A range is no proof.
    #[test]
    fn a_counter_that_goes_beyond_its_range_counts_by_its_bits() {
        let mut guard = counting(4, "[0|9]");
        let refused = (0..200).filter(|&frame: &i64| {
            feed_wide(&mut guard, frame.unsigned_abs() % 16, 20 * frame).is_err()
        });
        assert_eq!(refused.count(), 0);
    }

    #[test]
    fn a_wide_counter_that_restarts_is_heard_again() {
        let mut guard = wide(32);
        feed_wide(&mut guard, 3_000_000_000, 0).unwrap();
        feed_wide(&mut guard, 3_000_000_001, 20).unwrap();
        let heard = (0..1000_u32).find(|&frame| {
            let ms = 40 + 20 * i64::from(frame);
            feed_wide(&mut guard, u64::from(frame), ms).is_ok()
        });
        assert!(heard.is_some_and(|frame| frame < 200), "{heard:?}");
    }

    #[test]
    fn a_sender_that_hangs_stays_refused() {
        let mut guard = guard();
        feed(&mut guard, 0, 0).unwrap();
        feed(&mut guard, 1, 20).unwrap();
        for frame in 2..100 {
            assert_eq!(feed(&mut guard, 1, frame * 20), Err(FrameReject::Repeated));
        }
        assert!(feed(&mut guard, 2, 2000).is_ok());
    }

    #[test]
    fn a_backlog_that_comes_at_once_does_not_make_repetitions_pass() {
        let mut guard = guard();
        for count in 0..5 {
            feed(&mut guard, count, 20 * i64::from(count)).unwrap();
        }
        assert_eq!(
            (5..8)
                .map(|count| feed(&mut guard, count, 200).unwrap())
                .sum::<u64>(),
            0
        );
        assert_eq!(feed(&mut guard, 7, 220), Err(FrameReject::Repeated));
    }
}
