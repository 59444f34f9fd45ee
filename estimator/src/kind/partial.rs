//! This robot's sighting of another one that says a part only: news for that one, and a question to it.

use super::{Key, Kind, Measured, Origin, RobotId, check_numbers, check_variances};
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::partial::Reading;
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// This robot's sighting of another one by range and bearing, or by one of the two ([`crate::partial`]).
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PartialSighting {
    /// When the sensor saw it.
    pub stamp: Stamp,
    /// Which sensor.
    pub origin: Origin,
    /// Who was seen.
    pub observed: RobotId,
    /// What the sensor says.
    pub reading: Reading,
}

/// Which sighting is meant between two robots: a sensor's word, as [`Origin`] has it where it was seen.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SightingId {
    /// The other one of the two: for who saw, the robot seen; for that one, who saw it.
    pub robot: RobotId,
    /// Which of the observer's sensors.
    pub sensor: u16,
    /// Which life of it.
    pub session: u64,
    /// Its count.
    pub sequence: u64,
}

impl SightingId {
    /// The place of what is about this sighting.
    pub(super) fn key(&self, stamp: Stamp, kind: Kind) -> Key {
        Key {
            stamp,
            kind,
            source: u32::from(self.robot.0) << 16 | u32::from(self.sensor),
            session: self.session,
            sequence: self.sequence,
        }
    }
}

impl PartialSighting {
    /// Which one it is.
    #[must_use]
    pub fn id(&self) -> SightingId {
        SightingId {
            robot: self.observed,
            sensor: self.origin.source,
            session: self.origin.session,
            sequence: self.origin.sequence,
        }
    }
}

pub(super) fn check_reading(reading: &Reading) -> Result<(), Verdict> {
    check_numbers(&reading.numbers())?;
    check_variances(&reading.white())
}

impl Measured for PartialSighting {
    #[inline]
    fn key(&self) -> Key {
        self.id().key(self.stamp, Kind::Partial)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Partial, self.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_reading(&self.reading)
    }

    fn with_floor(&self, floors: &Floors) -> Self {
        let [x, y, _] = floors.sighting;
        Self {
            reading: self.reading.with_floor([x, y]),
            ..*self
        }
    }

    /// The belief is still the predicted one, as for a whole [`Sighting`](super::Sighting). Who does not know where it is tells nothing, and
    /// asks all the same; so does who has one number: what it says needs the heading too.
    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        let Reading::Place(place) = &self.reading else {
            if let Some(world) = world {
                world.tell(self, None);
            }
            return Gauge::default();
        };
        if let Some(world) = world {
            let told = world.has_told_after(self.stamp);
            let place = terms.tells.then(|| filter.tell_part(place, told));
            world.tell(self, place);
        }
        filter.shared();
        Gauge::default()
    }
}
