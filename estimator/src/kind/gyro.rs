//! What a gyro says: a yaw rate. It drives the prediction, as the wheels do, and takes no entry of the history ([`crate::gyro`]).

use super::{Key, Kind, Measured, Origin, check_numbers};
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// The yaw rate of the body up to `stamp`, since the sample before or, where that was lost, over a
/// [`period`](crate::gyro::GyroSettings::period).
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct GyroSample {
    /// When it was measured.
    pub stamp: Stamp,
    /// Which gyro.
    pub origin: Origin,
    /// Counter-clockwise \[rad/s\].
    pub rate_radps: f64,
    /// Density of its white noise \[rad²/s\]; zero: as the settings have it.
    pub noise: f64,
}

impl Measured for GyroSample {
    #[inline]
    fn key(&self) -> Key {
        Key::new(self.stamp, Kind::Gyro, self.origin)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Gyro, self.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_numbers(&[self.rate_radps, self.noise])?;
        (self.noise >= 0.0).then_some(()).ok_or(Verdict::NoNoise)
    }

    /// Its noise is the settings' already.
    fn with_floor(&self, _: &Floors) -> Self {
        *self
    }

    /// It has driven the prediction.
    fn apply(&self, _: &mut Filter, _: &Terms<'_>, _: Option<&mut Outbox>) -> Gauge {
        Gauge::default()
    }
}
