//! What is decided of a single robot, for whoever wants to know why.

use std::io::{Write as _, stdout};

use coloc_estimator::{FindingState, TickOutputs};

use super::world::seconds;
use crate::honest::increment::Place;

/// A line for every decision, and every second that it is not known where it is.
pub(super) fn tell(tick: u32, outputs: &TickOutputs<'_>, place: &Place) {
    let (now_s, finding) = (seconds(tick), outputs.finding);
    let mut out = stdout().lock();
    for (stamp, decision) in finding.decisions() {
        let of_s = coloc_estimator::Span::from_nanos(stamp.as_nanos()).as_seconds();
        let _ = writeln!(
            out,
            "{now_s:.2}: {decision:?}, by what was said at {of_s:.2}"
        );
    }
    let whole = tick.is_multiple_of(super::world::TICKS_PER_SECOND);
    let troubled = finding.state != FindingState::Ok || !finding.dissents().is_empty();
    let anew = finding.since.as_nanos() > 0 && now_s - seconds_of(finding.since) < 1.05;
    if (whole && troubled) || anew {
        let pose = outputs.estimate.belief.pose;
        let [x, y] = place.position;
        let sigmas = outputs.estimate.belief.total().variances().map(f64::sqrt);
        let against: Vec<_> = finding.dissents().iter().map(|it| it.source).collect();
        let _ = writeln!(
            out,
            "{now_s:.2}: {:?}, off by {:.2} m {:.2} m {:.2} rad, σ {sigmas:.2?}, against {against:?}",
            finding.state,
            pose.x - x,
            pose.y - y,
            coloc_estimator::angle::wrap(pose.phi - place.heading),
        );
    }
}

fn seconds_of(stamp: coloc_estimator::Stamp) -> f64 {
    coloc_estimator::Span::from_nanos(stamp.as_nanos()).as_seconds()
}
