//! What another robot says that has seen this one in part.

use super::{Ask, Key, Kind, Measured, SightingId, check_numbers, check_variances};
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::partial::{SplitPosition, told};
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// Position of this robot in the common frame, as another robot computed it from its own belief and its sighting of us. It says
/// nothing of our heading.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SeenPart {
    /// When the other robot saw us.
    pub stamp: Stamp,
    /// Who saw us, and which of its sightings it was.
    pub sighting: SightingId,
    /// Where we must be; `None`: it only asks.
    pub place: Option<SplitPosition>,
    /// Whether it asks where we believe to be.
    pub asks: bool,
}

impl SeenPart {
    /// The question in it.
    pub(crate) fn asks(&self) -> Option<Ask> {
        self.asks.then_some(Ask {
            stamp: self.stamp,
            sighting: self.sighting,
        })
    }
}

pub(super) fn check_place(place: &SplitPosition) -> Result<(), Verdict> {
    check_numbers(&place.position)?;
    check_variances(&place.variances())
}

impl Measured for SeenPart {
    /// One word of each sighting.
    #[inline]
    fn key(&self) -> Key {
        self.sighting.key(self.stamp, Kind::Seen)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Seen, self.sighting.robot.0)
    }

    fn check(&self) -> Result<(), Verdict> {
        self.place.as_ref().map_or(Ok(()), check_place)
    }

    fn with_floor(&self, floors: &Floors) -> Self {
        let [x, y, _] = floors.neighbour;
        Self {
            place: self.place.map(|it| it.with_floor([x, y])),
            ..*self
        }
    }

    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        let (verdict, gauge) = match &self.place {
            Some(place) => filter.hear_part(
                self.stamp,
                |belief| Some(told(belief, place)),
                terms.trusts(self.source()),
                terms.settings,
            ),
            None => (Verdict::Heard, Gauge::default()),
        };
        if let Some(world) = world {
            world.report(self.source(), self.stamp, verdict);
        }
        gauge
    }
}
