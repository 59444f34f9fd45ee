//! A pose that a person or a map says. One that a person sets is believed once it has left the history; one that a map says is
//! fused and judged like a neighbour's.

use super::{Key, Kind, Measured, Origin, check_numbers, check_variances};
use crate::belief::Belief;
use crate::convert::GlobalPose;
use crate::covariance::Covariance3;
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// Pose of this robot in the common frame, as somebody says it who is not a robot.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PoseSaid {
    /// When it was right.
    pub stamp: Stamp,
    /// Which person or map.
    pub origin: Origin,
    /// In the common frame.
    pub pose: Pose,
    /// Of its error, which may depend on anything.
    pub covariance: Covariance3,
    /// True: it is believed from then on, whatever was believed. False: it is one more source's word.
    pub set: bool,
}

impl PoseSaid {
    pub(crate) fn parts(&self) -> Parts {
        Parts::dependent(self.covariance)
    }

    /// What is believed of a robot of which nothing else is known.
    pub(crate) fn belief(&self) -> Belief {
        Belief::gaussian(self.pose, self.parts())
    }

    fn act(&self, filter: &mut Filter, terms: &Terms<'_>) -> (Verdict, Gauge) {
        if self.set {
            return (Verdict::Heard, Gauge::default());
        }
        let received = GlobalPose {
            pose: self.pose,
            parts: self.parts(),
        };
        let trusted = terms.trusts(self.source());
        filter.hear(self.stamp, &received, trusted, terms.settings)
    }
}

impl Measured for PoseSaid {
    #[inline]
    fn key(&self) -> Key {
        Key::new(self.stamp, Kind::Pose, self.origin)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Pose, self.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_numbers(self.pose.to_vector().as_slice())?;
        check_variances(&self.covariance.variances())
    }

    /// As a neighbour's.
    fn with_floor(&self, floors: &Floors) -> Self {
        Self {
            covariance: self.covariance.with_floor(floors.neighbour),
            ..*self
        }
    }

    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        let (verdict, gauge) = self.act(filter, terms);
        if let Some(world) = world {
            world.report(self.source(), self.stamp, verdict);
        }
        gauge
    }
}
