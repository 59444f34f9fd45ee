//! What the wheels say: a velocity over an interval. It drives the prediction and corrects nothing.

use super::{Key, Kind, Measured, Origin, check_numbers};
use crate::filter::Filter;
use crate::found::Gauge;
use crate::motion::Motion;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// The mean velocity over `(start, stamp]`, as the wheels saw it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct OdometrySample {
    /// Which wheels, if there are several sources of odometry.
    pub source: u16,
    /// Where the interval begins; the stamp of the frame before, for cumulative encoders.
    pub start: Stamp,
    /// Where the interval ends: the stamp of the frame.
    pub stamp: Stamp,
    /// Velocity and its noise per reference period (see [`crate::settings::OdometrySettings`]).
    pub motion: Motion,
}

impl Measured for OdometrySample {
    /// A sample is known by its interval; that which begins first comes first.
    #[inline]
    fn key(&self) -> Key {
        let origin = Origin {
            source: self.source,
            session: 0,
            sequence: in_order(self.start.as_nanos()),
        };
        Key::new(self.stamp, Kind::Odometry, origin)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Odometry, self.source)
    }

    #[inline]
    fn begins(&self) -> Stamp {
        self.start
    }

    #[inline]
    fn check(&self) -> Result<(), Verdict> {
        if self.start >= self.stamp {
            return Err(Verdict::EmptyInterval);
        }
        check_numbers(&self.motion.velocity())
    }

    /// Its noise is the settings' already.
    fn with_floor(&self, _: &Floors) -> Self {
        *self
    }

    /// It has driven the prediction.
    #[inline]
    fn apply(&self, _: &mut Filter, _: &Terms<'_>, _: Option<&mut Outbox>) -> Gauge {
        Gauge::default()
    }
}

/// Numbers that are in the order of the signed ones.
#[inline]
fn in_order(signed: i64) -> u64 {
    signed.cast_unsigned() ^ (1 << 63)
}
