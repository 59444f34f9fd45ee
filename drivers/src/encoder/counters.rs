//! What happened how often.

use super::channel::Continuity;
use super::counter::Cause;
use super::reject::FrameReject;

/// What a decoder has counted since the start.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct OdometryCounters {
    /// Frames of wanted messages that counted.
    pub accepted: u64,
    /// Frames of wanted messages that did not, by reason: index with [`OdometryCounters::of`].
    pub rejected: [u64; FrameReject::ALL.len()],
    /// Samples formed.
    pub samples: u64,
    /// Frames that are missing by the alive counters.
    pub skipped: u64,
    /// Times that a tick counter was taken up again at another value: the encoder restarted, or frames were missing for
    /// so long that the counter may have wrapped unseen.
    pub resynchronised: u64,
    /// Times out of those that the counter may have wrapped unseen. If that is every frame, it is too narrow for its speed.
    pub ambiguous: u64,
    /// Times out of those that the counter seemed to wrap elsewhere than its width or modulus says.
    pub other_wraps: u64,
    /// Samples that would have been faster than the robot can be, because late frames came at once: their way is spread
    /// over the samples that follow.
    pub late_ways: u64,
    /// Intervals too long to apply a speed to, left without a sample.
    pub gaps: u64,
}

impl OdometryCounters {
    /// How many frames were refused for `reason`.
    #[must_use]
    pub fn of(&self, reason: FrameReject) -> u64 {
        self.rejected[reason as usize]
    }

    /// Those of two decoders together.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        let mut sum = *self;
        let counts = [
            (&mut sum.accepted, other.accepted),
            (&mut sum.samples, other.samples),
            (&mut sum.skipped, other.skipped),
            (&mut sum.resynchronised, other.resynchronised),
            (&mut sum.ambiguous, other.ambiguous),
            (&mut sum.other_wraps, other.other_wraps),
            (&mut sum.late_ways, other.late_ways),
            (&mut sum.gaps, other.gaps),
        ];
        let rejected = sum.rejected.iter_mut().zip(other.rejected);
        for (count, more) in counts.into_iter().chain(rejected) {
            *count = count.saturating_add(more);
        }
        sum
    }

    pub(super) fn note(&mut self, continuity: Continuity) {
        let resynchronised = |cause| continuity == Continuity::Resynchronised(cause);
        self.gaps += u64::from(continuity == Continuity::Gap);
        self.resynchronised += u64::from(matches!(continuity, Continuity::Resynchronised(_)));
        self.ambiguous += u64::from(resynchronised(Cause::Ambiguous));
        self.other_wraps += u64::from(resynchronised(Cause::OtherWrap));
    }

    pub(super) fn note_reject(&mut self, reason: FrameReject) {
        self.rejected[reason as usize] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_breaks_a_count_is_noted_by_its_kind() {
        let mut counters = OdometryCounters::default();
        for continuity in [
            Continuity::Continued,
            Continuity::Started,
            Continuity::Gap,
            Continuity::Resynchronised(Cause::Ambiguous),
            Continuity::Resynchronised(Cause::OtherWrap),
            Continuity::Resynchronised(Cause::OtherWrap),
        ] {
            counters.note(continuity);
        }
        let noted = [
            counters.gaps,
            counters.resynchronised,
            counters.ambiguous,
            counters.other_wraps,
        ];
        assert_eq!(noted, [1, 3, 1, 2]);
    }
}
