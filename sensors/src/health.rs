//! Whether a sensor is of use, judged by what came of it.

use coloc_shm_types::Health;

/// Nothing for so long is silence (ns).
const PATIENCE_NS: i64 = 3_000_000_000;

/// What has come, each counted from the start.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Bytes.
    pub bytes: u64,
    /// Messages that were whole and right.
    pub whole: u64,
    /// What was said on the robot's channels, or looked through without anything to say.
    pub of_use: u64,
}

/// When each of the counts last grew.
#[derive(Clone, Debug, Default)]
pub struct Vitals {
    counts: Counts,
    heard_ns: Option<i64>,
    whole_ns: Option<i64>,
    of_use_ns: Option<i64>,
}

impl Vitals {
    /// The health at `now_ns` of a clock that nobody sets, now that so much has come.
    pub fn judge(&mut self, counts: Counts, now_ns: i64) -> Health {
        note(&mut self.heard_ns, counts.bytes, self.counts.bytes, now_ns);
        note(&mut self.whole_ns, counts.whole, self.counts.whole, now_ns);
        note(
            &mut self.of_use_ns,
            counts.of_use,
            self.counts.of_use,
            now_ns,
        );
        self.counts = counts;
        let is_fresh =
            |at: Option<i64>| at.is_some_and(|at| now_ns.saturating_sub(at) <= PATIENCE_NS);
        match (self.heard_ns, self.whole_ns, self.of_use_ns) {
            (None, ..) => Health::NeverSeen,
            (heard, ..) if !is_fresh(heard) => Health::Stale,
            (_, whole, _) if !is_fresh(whole) => Health::Faulty,
            (_, _, of_use) if !is_fresh(of_use) => Health::Refused,
            _ => Health::Ok,
        }
    }
}

fn note(at: &mut Option<i64>, count: u64, before: u64, now_ns: i64) {
    if count > before {
        *at = Some(now_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    #[test]
    fn the_worst_link_of_the_chain_is_the_health() {
        let mut vitals = Vitals::default();
        let mut now_ns = 0;
        let mut judge = |bytes, whole, of_use| {
            now_ns += 4 * SECOND;
            let counts = Counts {
                bytes,
                whole,
                of_use,
            };
            vitals.judge(counts, now_ns)
        };
        assert_eq!(judge(0, 0, 0), Health::NeverSeen);
        assert_eq!(judge(9, 0, 0), Health::Faulty);
        assert_eq!(judge(19, 1, 0), Health::Refused);
        assert_eq!(judge(29, 2, 1), Health::Ok);
        assert_eq!(judge(39, 3, 1), Health::Refused);
        assert_eq!(judge(49, 3, 1), Health::Faulty);
        assert_eq!(judge(49, 3, 1), Health::Stale);
        assert_eq!(judge(59, 4, 2), Health::Ok);
    }
}
