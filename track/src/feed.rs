//! What of a track feeds the exchange between robots, in the place of a sighting.

use coloc_estimator::{Span, Stamp};

use crate::manager::Track;
use crate::publish::{Published, publish};
use crate::state::State;

/// A heading less certain than this does not \[rad\]: others may be told it, but the sighting that gave way teaches more.
const HEADING_SIGMA: f64 = 0.2;

/// No more often: poses of one track say the same again, and each takes the place of a sighting that is answered.
const APART: Span = Span::from_millis(1000);

/// The pose of `track` that takes the place of a sighting which it has just accepted, if one does; `last` is when one did before.
///
/// Both numbers are chosen on MR.CLAM, where robots that told every pose that may be published were up to a fifth worse off.
#[must_use]
pub fn feed(track: &Track, last: Option<Stamp>) -> Option<State> {
    let Published::Pose(state) = publish(track) else {
        return None;
    };
    let is_due = last.is_none_or(|last| track.last - last >= APART);
    let is_known = state.covariance[(2, 2)] < HEADING_SIGMA * HEADING_SIGMA;
    (is_due && is_known).then_some(state)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manager::Status;
    use crate::state::Core;
    use coloc_estimator::RobotId;

    fn track(heading_sigma: f64) -> Track {
        let mut state = State {
            core: Core::Heading,
            ..State::default()
        };
        for (place, sigma) in [0.1, 0.1, heading_sigma].into_iter().enumerate() {
            state.covariance[(place, place)] = sigma * sigma;
        }
        Track {
            id: RobotId(2),
            state,
            status: Status::Confirmed,
            hits: 9,
            rejects: 0,
            last: Stamp::from_nanos(5_000_000_000),
            identified: true,
        }
    }

    #[test]
    fn a_pose_takes_the_place_of_a_sighting_if_its_heading_is_known_and_it_is_not_said_again() {
        let known = track(0.1);
        assert_eq!(feed(&known, None), Some(known.state));
        assert_eq!(feed(&track(0.3), None), None);
        let ago = |millis| Some(known.last - Span::from_millis(millis));
        assert_eq!(feed(&known, ago(999)), None);
        assert_eq!(feed(&known, ago(1000)), Some(known.state));
        let tentative = Track {
            status: Status::Tentative,
            ..known
        };
        assert_eq!(feed(&tentative, None), None);
    }
}
