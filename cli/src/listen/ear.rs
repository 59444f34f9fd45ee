//! Being where a robot is heard.

use coloc_shm_types::{Estimate, Lost, RobotName, Space, Subscriber};

use super::ListenError;
use crate::place::Place;

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
    pub(super) fn why_silent(&self, robot: &RobotName) -> String {
        let running = Space::running(&self.place.root).unwrap_or_default();
        let own = running.iter().find(|one| one.robot == *robot);
        match own.map(|own| own.who) {
            None => "does not run any more, waiting for it".into(),
            Some(None) => "runs and says nothing".into(),
            Some(Some((_, process))) => {
                format!("is silent, though process {process} acts for it")
            }
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
