//! Another robot has seen this one, and learns where it believes to be.

use super::{Key, Kind, Measured, SightingId};
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// A question, which comes with what the other robot tells: [`SeenPart`](super::SeenPart).
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Ask {
    /// When this robot was seen.
    pub stamp: Stamp,
    /// By whom, and which of its sightings it was.
    pub sighting: SightingId,
}

impl Measured for Ask {
    #[inline]
    fn key(&self) -> Key {
        self.sighting.key(self.stamp, Kind::Ask)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Seen, self.sighting.robot.0)
    }

    fn check(&self) -> Result<(), Verdict> {
        Ok(())
    }

    fn with_floor(&self, _: &Floors) -> Self {
        *self
    }

    /// The belief is still the predicted one. Who does not know where it is has no answer.
    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        if let Some(world) = world.filter(|_| terms.tells) {
            let told = world.has_told_after(self.stamp);
            world.answer(self, filter.answer(told));
        }
        filter.shared();
        Gauge::default()
    }
}
