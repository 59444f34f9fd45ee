//! The speed at which a recording is played.

use std::io;
use std::time::{Duration, Instant};

use crate::stop::{Stop, Woken};

/// What lies further apart in a recording was not recorded in one go: it is not waited for.
const LONGEST: Duration = Duration::from_secs(60);

/// Holds a recording back until its time.
#[derive(Debug, Default)]
pub struct Pace {
    begin: Option<(Instant, i64)>,
}

impl Pace {
    /// Waits until what was recorded at `recorded_ns` is due; whether the program was asked to end meanwhile.
    ///
    /// # Errors
    /// As [`Stop::wait`].
    pub fn keep(&mut self, recorded_ns: i64, stop: &Stop) -> io::Result<bool> {
        let now = Instant::now();
        let (begin, first_ns) = *self.begin.get_or_insert((now, recorded_ns));
        let since = u64::try_from(recorded_ns.saturating_sub(first_ns)).ok();
        let due = since.and_then(|since| begin.checked_add(Duration::from_nanos(since)));
        let wait = due.map(|due| due.saturating_duration_since(now));
        match wait.filter(|wait| *wait <= LONGEST) {
            Some(Duration::ZERO) => Ok(false),
            Some(wait) => Ok(stop.wait(None, wait)? == Woken::Stop),
            // It jumps: from here it goes on at its own speed.
            None => {
                self.begin = Some((now, recorded_ns));
                Ok(false)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const HOUR: i64 = 3_600_000_000_000;

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
}
