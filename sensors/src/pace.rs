//! The speed at which a recording is played.

use std::io;
use std::time::{Duration, Instant};

use crate::stop::{Stop, Woken};

/// What lies further apart in a recording was not recorded in one go: it is not waited for (ns).
const LONGEST_NS: i64 = 60_000_000_000;
/// What lies further back than that is of another time, and no line that came late (ns).
const BACK_NS: i64 = 1_000_000_000;

/// When what was recorded is due, on a clock of the present: `t = t0 + (r − r0)`. Where the recording jumps, it goes on from the present.
#[derive(Copy, Clone, Debug, Default)]
pub struct Playback {
    piece: Option<Piece>,
}

/// What was recorded in one go.
#[derive(Copy, Clone, Debug)]
struct Piece {
    /// How far the present is ahead of it (ns).
    ahead_ns: i64,
    /// The newest of it (ns).
    newest_ns: i64,
}

impl Piece {
    fn due_ns(&self, recorded_ns: i64) -> i64 {
        recorded_ns.saturating_add(self.ahead_ns)
    }
}

impl Playback {
    /// When what was recorded at `recorded_ns` is due, now that it is `now_ns`.
    pub fn due_ns(&mut self, recorded_ns: i64, now_ns: i64) -> i64 {
        let goes_on = |piece: &Piece| {
            let step_ns = recorded_ns.saturating_sub(piece.newest_ns);
            (-BACK_NS..=LONGEST_NS).contains(&step_ns)
        };
        let Some(mut piece) = self.piece.filter(goes_on) else {
            return self.begin(recorded_ns, now_ns);
        };
        piece.newest_ns = piece.newest_ns.max(recorded_ns);
        self.piece = Some(piece);
        piece.due_ns(recorded_ns)
    }

    /// The stamp of what was recorded at `recorded_ns` and is said now: nothing was measured after that.
    pub fn stamp_ns(&mut self, recorded_ns: i64, now_ns: i64) -> i64 {
        self.due_ns(recorded_ns, now_ns).min(now_ns)
    }

    /// It goes on from here, after all that was due.
    fn begin(&mut self, recorded_ns: i64, now_ns: i64) -> i64 {
        let last_ns = self.piece.map(|it| it.due_ns(it.newest_ns));
        let after_ns = last_ns.map_or(i64::MIN, |last_ns| last_ns.saturating_add(1));
        let due_ns = now_ns.max(after_ns);
        self.piece = Some(Piece {
            ahead_ns: due_ns.saturating_sub(recorded_ns),
            newest_ns: recorded_ns,
        });
        due_ns
    }
}

/// Holds a recording back until its time.
#[derive(Debug)]
pub struct Pace {
    begin: Instant,
    playback: Playback,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            begin: Instant::now(),
            playback: Playback::default(),
        }
    }
}

impl Pace {
    /// Waits until what was recorded at `recorded_ns` is due; whether the program was asked to end meanwhile.
    ///
    /// # Errors
    /// As [`Stop::wait`].
    pub fn keep(&mut self, recorded_ns: i64, stop: &Stop) -> io::Result<bool> {
        let now_ns = i64::try_from(self.begin.elapsed().as_nanos()).unwrap_or(i64::MAX);
        let due_ns = self.playback.due_ns(recorded_ns, now_ns);
        match u64::try_from(due_ns.saturating_sub(now_ns)) {
            Ok(wait_ns) if wait_ns > 0 => {
                Ok(stop.wait(None, Duration::from_nanos(wait_ns))? == Woken::Stop)
            }
            _ => Ok(false),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const SECOND: i64 = 1_000_000_000;
    const HOUR: i64 = 3600 * SECOND;

    #[test]
    fn a_jump_of_the_recording_is_not_waited_for() {
        let (stop, mut told) = Stop::by_hand().unwrap();
        let mut pace = Pace::default();
        for recorded_ns in [HOUR, HOUR, 9 * HOUR, HOUR, i64::MAX, i64::MIN] {
            assert!(!pace.keep(recorded_ns, &stop).unwrap());
        }
        told.write_all(b"!").unwrap();
        let mut pace = Pace::default();
        assert!(!pace.keep(0, &stop).unwrap());
        assert!(pace.keep(50_000_000_000, &stop).unwrap());
    }

    #[test]
    fn after_a_jump_it_goes_on_from_the_present_at_its_own_speed() {
        let mut playback = Playback::default();
        let mut now_ns = 7 * HOUR;
        // A gap of an hour, a clock that was set back, and between them a line that came late.
        for (recorded_s, due_s) in [
            (100, 0),
            (102, 2),
            (3702, 2),
            (3703, 3),
            (3702, 2),
            (3704, 4),
            (10, 4),
            (11, 5),
        ] {
            let due_ns = playback.due_ns(recorded_s * SECOND, now_ns);
            let off_ns = due_ns - (7 * HOUR + due_s * SECOND);
            assert!((0..10).contains(&off_ns), "{recorded_s} s: {off_ns} ns");
            now_ns = now_ns.max(due_ns);
        }
    }

    #[test]
    fn what_follows_a_jump_is_later_than_all_before() {
        let mut playback = Playback::default();
        assert_eq!(playback.due_ns(0, 5), 5);
        assert_eq!(playback.due_ns(9, 5), 14);
        assert_eq!(playback.due_ns(HOUR, 5), 15);
    }
}
