//! Being where a robot is heard.

use std::fmt;

use coloc_shm_types::{RobotName, Space};

use super::ListenError;
use crate::estimates::{Change, Estimates, Station};
use crate::place::Place;

/// Why a robot is not heard.
#[derive(Debug)]
pub(super) enum WhySilent {
    /// Nobody acts for it.
    Gone,
    /// This process does, if it has said so.
    Runs(Option<u32>),
}

impl fmt::Display for WhySilent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gone => f.write_str("does not run any more, waiting for it"),
            Self::Runs(None) => f.write_str("runs and says nothing"),
            Self::Runs(Some(process)) => {
                write!(f, "is silent, though process {process} acts for it")
            }
        }
    }
}

/// What it is heard with.
pub(super) struct Ear {
    estimates: Estimates,
    station: Station,
    place: Place,
}

impl Ear {
    pub(super) fn open(place: &Place, robot: &RobotName) -> Result<Self, ListenError> {
        let station = Station::enter(place, "coloc-listen")?;
        let estimates = station.hear(robot)?;
        Ok(Self {
            estimates,
            station,
            place: place.clone(),
        })
    }

    /// As far as that can be seen.
    pub(super) fn why_silent(&self, robot: &RobotName) -> WhySilent {
        let running = Space::running(&self.place.root).unwrap_or_default();
        match running.into_iter().find(|one| one.robot == *robot) {
            None => WhySilent::Gone,
            Some(own) => WhySilent::Runs(own.who.map(|(_, process)| process)),
        }
    }

    pub(super) fn estimates(&self) -> &Estimates {
        &self.estimates
    }

    /// Whether a robot that starts now would be heard.
    pub(super) fn check(&self) -> Option<Change> {
        self.station.check(&self.estimates)
    }
}
