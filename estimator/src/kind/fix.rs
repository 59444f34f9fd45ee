//! A position fix: the Kalman filter's update, after the exchange is over.

use super::{Key, Kind, Measured, Origin, check_numbers, check_variances};
use crate::covariance::Covariance2;
use crate::filter::Filter;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::settings::{Floors, Settings};
use crate::stamp::Stamp;

/// A satellite fix in the common frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PositionFix {
    /// When the position was valid.
    pub stamp: Stamp,
    /// Which receiver.
    pub origin: Origin,
    /// `[x, y]` \[m\].
    pub position: [f64; 2],
    /// `R_A` \[m²\].
    pub covariance: Covariance2,
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
        check_variances(&self.covariance.variances())
    }

    fn with_floor(&self, floors: &Floors) -> Self {
        Self {
            covariance: self.covariance.with_floor(floors.fix),
            ..*self
        }
    }

    fn apply(&self, filter: &mut Filter, settings: &Settings, world: Option<&mut Outbox>) {
        let gate = filter.correct(self.position, &self.covariance, settings);
        if let Some(world) = world {
            world.report(self.source(), self.stamp, gate.verdict());
        }
    }
}
