//! Where a robot that this one has seen in part believed to be.

use super::seen::check_place;
use super::{Key, Kind, Measured, SightingId};
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::partial::{Reading, SplitPosition, observed, observed_alone};
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// The answer of a robot that was seen. What was seen of it is looked up in the history.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Answer {
    /// When it was seen.
    pub stamp: Stamp,
    /// Who was seen, and in which of our sightings.
    pub sighting: SightingId,
    /// Where it believed to be, before anything of that stamp.
    pub place: SplitPosition,
    /// What our sensor said then; the history's word, whatever stands here.
    pub reading: Option<Reading>,
}

impl Answer {
    /// The place of the sighting in the history.
    pub(crate) fn asked(&self) -> Key {
        self.sighting.key(self.stamp, Kind::Partial)
    }
}

impl Measured for Answer {
    /// One answer to each sighting.
    #[inline]
    fn key(&self) -> Key {
        self.sighting.key(self.stamp, Kind::Answer)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Answer, self.sighting.robot.0)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_place(&self.place)
    }

    fn with_floor(&self, floors: &Floors) -> Self {
        let [x, y, _] = floors.neighbour;
        Self {
            place: self.place.with_floor([x, y]),
            ..*self
        }
    }

    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        let Some(reading) = &self.reading else {
            return Gauge::default(); // Nobody lets it in without.
        };
        let trusted = terms.trusts(self.source());
        let (verdict, gauge) = filter.hear_part(
            self.stamp,
            |belief| match reading {
                Reading::Place(place) => Some(observed(belief, place, &self.place)),
                Reading::Alone(number) => observed_alone(belief, number, &self.place),
            },
            trusted,
            terms.settings,
        );
        if let Some(world) = world {
            world.report(self.source(), self.stamp, verdict);
        }
        gauge
    }
}
