//! What a leader says of this robot, through whatever chain of children: [`crate::assist`]. That it is used was decided when it came, by
//! the search; here it has its place in the history as everything has.

use super::{Key, Kind, Measured, Origin, RobotId, check_numbers, check_variances};
use crate::assist::bond::Bonds;
use crate::assist::slot::Slot;
use crate::assist::ties::Said;
use crate::convert::GlobalPose;
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// Pose of this robot in the common frame, composed of a leader's belief and of sightings alone.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct LeaderPose {
    /// When it holds.
    pub stamp: Stamp,
    /// Whose it is.
    pub leader: RobotId,
    /// Of which event; there is one of each leader and event.
    pub slot: Slot,
    /// y*, and R* in its parts: what is dependent is the leader's error.
    pub said: GlobalPose,
}

impl LeaderPose {
    /// As [`Measured::apply`], where errors are tracked.
    pub(crate) fn apply_tied(
        &self,
        filter: &mut Filter,
        (bonds, said): (&mut Bonds, &Said),
        terms: &Terms<'_>,
        world: Option<&mut Outbox>,
    ) -> Gauge {
        let trusted = terms.trusts(self.source());
        let (verdict, gauge) = filter.hear_tied(&self.said, (bonds, said), trusted, terms.settings);
        if let Some(world) = world {
            world.report(self.source(), self.stamp, verdict);
        }
        gauge
    }
}

impl Measured for LeaderPose {
    #[inline]
    fn key(&self) -> Key {
        let origin = Origin {
            source: self.leader.0,
            session: 0,
            sequence: self.slot.0.cast_unsigned(),
        };
        Key::new(self.stamp, Kind::Assist, origin)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Assist, self.leader.0)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_numbers(self.said.pose.to_vector().as_slice())?;
        check_variances(&self.said.total().variances())
    }

    /// As a neighbour's.
    fn with_floor(&self, floors: &Floors) -> Self {
        let parts = self.said.parts.with_floor(floors.neighbour);
        Self {
            said: GlobalPose { parts, ..self.said },
            ..*self
        }
    }

    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        let trusted = terms.trusts(self.source());
        let (verdict, gauge) = filter.hear_leader(&self.said, trusted, terms.settings);
        if let Some(world) = world {
            world.report(self.source(), self.stamp, verdict);
        }
        gauge
    }
}
