//! A position fix: the Kalman filter's update, after the exchange is over.

use super::{Key, Kind, Measured, Origin, check_numbers, check_variances};
use crate::covariance::Covariance2;
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::settings::Floors;
use crate::stamp::{Span, Stamp};
use crate::terms::Terms;

/// A satellite fix in the common frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PositionFix {
    /// When the position was valid.
    pub stamp: Stamp,
    /// Which receiver.
    pub origin: Origin,
    /// `[x, y]` \[m\].
    pub position: [f64; 2],
    /// `R_A` \[m²\]: of what is new in each fix.
    pub covariance: Covariance2,
    /// Where the antenna is in the body frame, forward and left \[m\]: what it says depends on the heading, and teaches it.
    pub lever: [f64; 2],
    /// Of what is not.
    pub slow: SlowError,
}

/// The slow error of a sensor, in each coordinate that it measures: atmosphere, orbits and reflections of a receiver, iron and currents
/// near a compass; a first-order Gauss–Markov process, shared by measurements that follow each other.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct SlowError {
    /// `σ_s²` \[m² of a fix, rad² of a heading\], zero where there is none.
    pub variance: f64,
    /// τ, how long it lasts.
    pub memory: Span,
}

impl SlowError {
    /// One that is no more than zero, or that lasts for no time, is none.
    #[inline]
    pub(crate) fn is_there(&self) -> bool {
        self.variance > 0.0 && self.memory > Span::ZERO
    }
}

impl Measured for PositionFix {
    #[inline]
    fn key(&self) -> Key {
        Key::new(self.stamp, Kind::Fix, self.origin)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Fix, self.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_numbers(&self.position)?;
        check_numbers(&self.lever)?;
        check_numbers(&[self.slow.variance])?;
        check_variances(&self.covariance.variances())
    }

    fn with_floor(&self, floors: &Floors) -> Self {
        Self {
            covariance: self.covariance.with_floor(floors.fix),
            ..*self
        }
    }

    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        let (verdict, gauge) = filter.correct(self, terms);
        if let Some(world) = world {
            world.report(self.source(), self.stamp, verdict);
        }
        gauge
    }
}
