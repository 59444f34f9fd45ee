//! A sighting of a place that is known: its answer comes with it.

use super::partial::check_reading;
use super::{Key, Kind, Measured, Origin, check_numbers, check_variances};
use crate::covariance::Covariance2;
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::partial::{Reading, SplitPosition, observed, observed_alone};
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// This robot's sighting of a landmark or a beacon.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct LandmarkSighting {
    /// When the sensor saw it.
    pub stamp: Stamp,
    /// Which sensor.
    pub origin: Origin,
    /// Which landmark.
    pub landmark: u16,
    /// What the sensor says.
    pub reading: Reading,
    /// Where the landmark is \[m\].
    pub position: [f64; 2],
    /// Of `position`: an error that never changes.
    pub covariance: Covariance2,
}

impl Measured for LandmarkSighting {
    #[inline]
    fn key(&self) -> Key {
        Key {
            source: u32::from(self.landmark) << 16 | u32::from(self.origin.source),
            ..Key::new(self.stamp, Kind::Landmark, self.origin)
        }
    }

    fn source(&self) -> Source {
        Source::new(Kind::Landmark, self.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_reading(&self.reading)?;
        check_numbers(&self.position)?;
        check_variances(&self.covariance.variances())
    }

    fn with_floor(&self, floors: &Floors) -> Self {
        let [x, y, _] = floors.sighting;
        Self {
            reading: self.reading.with_floor([x, y]),
            ..*self
        }
    }

    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        let known = SplitPosition::known(self.position, self.covariance);
        let (verdict, gauge) = filter.hear_part(
            self.stamp,
            |belief| match &self.reading {
                Reading::Place(place) => Some(observed(belief, place, &known)),
                Reading::Alone(number) => observed_alone(belief, number, &known),
            },
            terms.trusts(self.source()),
            terms.settings,
        );
        if let Some(world) = world {
            world.report(self.source(), self.stamp, verdict);
        }
        gauge
    }
}
