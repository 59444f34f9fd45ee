//! What a neighbour says about this robot: Algorithm 3.

use super::{Key, Kind, Measured, Origin, RobotId, check_numbers, check_variances};
use crate::convert::GlobalPose;
use crate::covariance::Covariance3;
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::rounds::Bond;
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// Pose of this robot in the common frame, as a neighbour computed it from its own belief and its sighting of us.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct NeighbourPose {
    /// When the neighbour saw us.
    pub stamp: Stamp,
    /// Who saw us, and its count of what it sent to us.
    pub origin: Origin,
    /// y*, in the common frame.
    pub pose: Pose,
    /// R*_i and R*_d.
    pub parts: Parts,
}

impl NeighbourPose {
    /// Who saw us.
    #[must_use]
    pub fn sender(&self) -> RobotId {
        RobotId(self.origin.source)
    }

    /// Whether nothing of it is independent, as of a [`TrackPose`](super::TrackPose): it may have this robot's own wheels in it.
    fn is_of_anything(&self) -> bool {
        self.parts.independent == Covariance3::ZERO
    }
}

/// `P_d := P`, `P_i := 0`: nothing of the belief is independent of what is heard next. In rounds nothing is anyway.
fn give_up(filter: &mut Filter) {
    if filter.bond.as_ref().is_none_or(Bond::is_apart) {
        filter.shared();
        filter.leave();
    }
}

impl Measured for NeighbourPose {
    #[inline]
    fn key(&self) -> Key {
        Key::new(self.stamp, Kind::Neighbour, self.origin)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Neighbour, self.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_numbers(self.pose.to_vector().as_slice())?;
        check_variances(&self.parts.total().variances())
    }

    /// What is added may be anything: it is dependent.
    fn with_floor(&self, floors: &Floors) -> Self {
        Self {
            parts: self.parts.with_floor(floors.neighbour),
            ..*self
        }
    }

    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        if self.is_of_anything() {
            give_up(filter);
        }
        let received = GlobalPose {
            pose: self.pose,
            parts: self.parts,
        };
        let (verdict, gauge) = filter.hear(
            self.stamp,
            &received,
            terms.trusts(self.source()),
            terms.settings,
        );
        if let Some(world) = world {
            world.report(self.source(), self.stamp, verdict);
        }
        gauge
    }
}
