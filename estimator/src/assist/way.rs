//! From where a robot was at one moment to where it was at another, by its own wheels.

use super::datum::{Reading, carried, extend, first, reversed};
use crate::belief::Belief;
use crate::convert::GlobalPose;
use crate::estimator::Estimator;
use crate::history::Storage;
use crate::parts::Parts;
use crate::settings::Propagation;
use crate::stamp::Stamp;

/// The robot's own way, gone back where it has to be.
pub(super) fn way_of<S: Storage>(
    estimator: &Estimator<S>,
    from: Stamp,
    to: Stamp,
) -> Option<Reading> {
    if from <= to {
        estimator.way(from, to)
    } else {
        estimator.way(to, from).as_ref().map(reversed)
    }
}

/// Where a leader's sighting puts a child: from where it was at the event, by its own wheels to where it saw the child.
pub(super) fn said_of(
    leader: &Belief,
    way: Option<&Reading>,
    reading: &Reading,
    propagation: Propagation,
) -> GlobalPose {
    let Some(way) = way else {
        return first(leader, reading, propagation);
    };
    let from = GlobalPose {
        pose: leader.pose,
        parts: Parts::dependent(leader.total()),
    };
    extend(&carried(&from, way, propagation), reading, propagation)
}
