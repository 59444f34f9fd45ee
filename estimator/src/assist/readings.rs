//! What a robot has seen of children in one event, as it tells all leaders where these know all readings.

use super::datum::Reading;
use super::search::MOST_READINGS;
use super::slot::Slot;
use super::trail::Trail;
use crate::kind::{Origin, RobotId};
use crate::stamp::{Span, Stamp};

/// A child that it saw.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Sight {
    /// Whom.
    pub observed: RobotId,
    /// So long after the beginning of the event.
    pub since: Span,
    /// How.
    pub reading: Reading,
}

/// All of one event, said once.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Readings {
    /// Which event.
    pub slot: Slot,
    /// Its middle.
    pub stamp: Stamp,
    /// The trace of a leader's covariance; `None` of a child, and of a leader that does not know where it is.
    pub trace: Option<f64>,
    /// Its own way meanwhile, if it knows that.
    pub trail: Option<Trail>,
    /// No more than `count` of them.
    pub sights: [Sight; MOST_READINGS],
    /// How many they are.
    pub count: u8,
}

/// Such a word that comes; nothing of it is believed yet.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct HeardReadings {
    /// Who says it, and its count.
    pub origin: Origin,
    /// What it says.
    pub readings: Readings,
}

impl Default for Readings {
    fn default() -> Self {
        Self {
            slot: Slot::default(),
            stamp: Stamp::default(),
            trace: None,
            trail: None,
            sights: [Sight::default(); MOST_READINGS],
            count: 0,
        }
    }
}

impl Readings {
    /// What it saw.
    #[must_use]
    pub fn sights(&self) -> &[Sight] {
        let sights = self.sights.get(..usize::from(self.count));
        sights.unwrap_or(&self.sights)
    }

    /// One more; false if there are too many.
    #[must_use]
    pub fn push(&mut self, sight: Sight) -> bool {
        let Some(place) = self.sights.get_mut(usize::from(self.count)) else {
            return false;
        };
        *place = sight;
        self.count += 1;
        true
    }
}
