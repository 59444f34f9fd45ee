//! Where another robot is, as a track of it has it: news for that one of which nothing is independent.

use super::{Key, Kind, Measured, Sighting};
use crate::convert::GlobalPose;
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::parts::Parts;
use crate::settings::Floors;
use crate::terms::Terms;

/// A filter's pose of another robot, made of many sightings and of what both robots' wheels said.
///
/// Its error has the wheels' of both in it, and that of the sightings before, which may have been told. So nothing of what is told of
/// it is independent, and nothing of the belief stays so, neither here nor where it is heard.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct TrackPose(pub Sighting);

impl Measured for TrackPose {
    #[inline]
    fn key(&self) -> Key {
        self.0.key().as_kind(Kind::Track)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Track, self.0.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        self.0.check()
    }

    fn with_floor(&self, floors: &Floors) -> Self {
        Self(self.0.with_floor(floors))
    }

    /// The belief is still the predicted one.
    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        let Self(seen) = self;
        if let Some(world) = world.filter(|_| terms.tells) {
            let told = filter.tell(&seen.relative, &seen.covariance, terms.settings);
            let parts = Parts::dependent(told.total());
            world.send(seen, &GlobalPose { parts, ..told });
        }
        filter.shared();
        Gauge::default()
    }
}
