//! This robot's sighting of another one: news for that one, Algorithm 2.

use super::{Key, Kind, Measured, Origin, RobotId, check_numbers, check_variances};
use crate::covariance::Covariance3;
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::pose::Pose;
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// This robot's sighting of another one.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sighting {
    /// When the sensor saw it.
    pub stamp: Stamp,
    /// Which sensor.
    pub origin: Origin,
    /// Who was seen.
    pub observed: RobotId,
    /// Pose of the observed robot in this robot's body frame.
    pub relative: Pose,
    /// Noise of `relative`, R.
    pub covariance: Covariance3,
}

impl Measured for Sighting {
    #[inline]
    fn key(&self) -> Key {
        Key {
            source: u32::from(self.observed.0) << 16 | u32::from(self.origin.source),
            ..Key::new(self.stamp, Kind::Sighting, self.origin)
        }
    }

    fn source(&self) -> Source {
        Source::new(Kind::Sighting, self.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_numbers(self.relative.to_vector().as_slice())?;
        check_variances(&self.covariance.variances())
    }

    fn with_floor(&self, floors: &Floors) -> Self {
        Self {
            covariance: self.covariance.with_floor(floors.sighting),
            ..*self
        }
    }

    /// The belief is still the predicted one: sightings come before all that changes it.
    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        // Who does not know where it is tells nothing.
        if let Some(world) = world.filter(|_| terms.tells) {
            let seen = filter.tell(&self.relative, &self.covariance, terms.settings);
            world.send(self, &seen);
        }
        filter.told(terms.settings);
        Gauge::default()
    }
}
