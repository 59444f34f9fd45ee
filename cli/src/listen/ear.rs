//! Being where a robot is heard.

use std::fmt;

use coloc_shm_types::{Estimate, Lost, RobotName, Space, Subscriber};

use super::ListenError;
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
    estimates: Subscriber<Estimate>,
    space: Space,
    place: Place,
}

impl Ear {
    pub(super) fn open(place: &Place, robot: &RobotName) -> Result<Self, ListenError> {
        let space = Space::join(&place.root, &place.prefix, "coloc-listen")?;
        let estimates = space.subscriber(robot)?;
        Ok(Self {
            estimates,
            space,
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

    pub(super) fn estimates(&self) -> &Subscriber<Estimate> {
        &self.estimates
    }

    /// Whether a robot that starts now would be heard.
    pub(super) fn check(&self) -> Result<(), Lost> {
        self.space.check()
    }
}
