//! How often somebody speaks.

/// Of the newest interval, so much goes into the mean …
const NEWEST: i64 = 4;
/// … and no more than so many times the mean: an outage is no interval.
const OUTLIER: i64 = 4;
/// Nobody is waited for longer than for one with this interval \[ns\].
const LONGEST_NS: i64 = 60_000_000_000;

/// The mean interval of one who speaks, which follows when it changes.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Rhythm {
    mean_ns: i64,
}

impl Rhythm {
    /// Takes in the newest interval \[ns\]. One that is not positive says nothing: it is of messages that came in one go, or late.
    #[inline]
    pub fn note(&mut self, interval_ns: i64) {
        if interval_ns <= 0 {
            return;
        }
        let mean_ns = match self.mean_ns {
            0 => interval_ns,
            mean_ns => {
                let newest_ns = interval_ns.min(mean_ns * OUTLIER);
                mean_ns + (newest_ns - mean_ns) / NEWEST
            }
        };
        self.mean_ns = mean_ns.min(LONGEST_NS);
    }

    /// The mean interval, at most a minute; 0 while none is known \[ns\].
    #[must_use]
    #[inline]
    pub const fn interval_ns(self) -> i64 {
        self.mean_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(intervals_ns: impl IntoIterator<Item = i64>) -> i64 {
        let mut rhythm = Rhythm::default();
        intervals_ns.into_iter().for_each(|it| rhythm.note(it));
        rhythm.interval_ns()
    }

    #[test]
    fn it_follows_and_an_outage_is_no_interval() {
        assert_eq!(after([]), 0);
        assert_eq!(after([200, 200, 0, -7]), 200);
        assert_eq!(after([100, i64::MAX]), 175);
        let slower = std::iter::repeat_n(100, 10).chain(std::iter::repeat_n(2000, 30));
        assert!((1990..=2000).contains(&after(slower)));
    }

    #[test]
    fn nobody_is_waited_for_without_end() {
        assert_eq!(after([i64::MAX]), LONGEST_NS);
        assert_eq!(after([1; 100]), 1, "nor not at all");
        assert_eq!(after([i64::MAX, 1, i64::MAX, i64::MAX]), LONGEST_NS);
    }
}
