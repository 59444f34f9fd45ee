//! Whether a robot was right about what it said of itself.

use coloc_estimator::{FindingState, Pose};
use coloc_sim::metrics::Sample;

use crate::replay::PlayedTick;

/// NEES of the pose, χ² with three degrees of freedom: an honest robot is beyond it once in a million times.
const WRONG: f64 = 30.66;

/// Ticks, and times since an event.
#[derive(Clone, Debug, Default)]
pub(crate) struct Verdict {
    pub(crate) ticks: usize,
    pub(crate) not_ok: usize,
    /// While it was ok.
    pub(crate) wrong: usize,
    /// In a row.
    pub(crate) longest_wrong: usize,
    pub(crate) left_ok: usize,
    /// Before the event where negative.
    pub(crate) first_ok_s: Option<f64>,
    /// First not ok after the event.
    pub(crate) noticed_s: Option<f64>,
    /// Ok and right again.
    pub(crate) found_s: Option<f64>,
    pub(crate) ok_at_end: bool,
}

#[allow(clippy::cast_precision_loss)] // Half a minute.
pub(crate) fn judge(ticks: &[PlayedTick], event_ns: i64, truth: impl Fn(i64) -> Pose) -> Verdict {
    let mut verdict = Verdict::default();
    let mut row = 0;
    for tick in ticks {
        let stamp_ns = tick.published.stamp_ns;
        let since_s = (stamp_ns - event_ns) as f64 / 1e9;
        let belief = &tick.belief;
        let sample = Sample::new(&belief.pose, &belief.total().matrix(), &truth(stamp_ns));
        let (is_ok, is_right) = (tick.state == FindingState::Ok, sample.nees <= WRONG);
        row = if is_ok && !is_right { row + 1 } else { 0 };
        verdict.ticks += 1;
        verdict.not_ok += usize::from(!is_ok);
        verdict.wrong += usize::from(is_ok && !is_right);
        verdict.longest_wrong = verdict.longest_wrong.max(row);
        verdict.left_ok += usize::from(verdict.ok_at_end && !is_ok);
        if is_ok {
            verdict.first_ok_s.get_or_insert(since_s);
        } else if since_s > 0.0 {
            verdict.noticed_s.get_or_insert(since_s);
        }
        if is_ok && is_right && verdict.noticed_s.is_some() {
            verdict.found_s.get_or_insert(since_s);
        }
        verdict.ok_at_end = is_ok;
    }
    verdict
}
