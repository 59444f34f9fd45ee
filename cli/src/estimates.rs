//! What a robot says, for those who only listen: from its channel or, if it is another user's, from the page that is open to
//! their group.

use std::os::fd::BorrowedFd;

use coloc_shm_types::{
    Estimate, Lost, OpenError, PortError, ReadError, Reader, RobotName, Space, Subscriber,
};

use crate::place::Place;

/// Where robots are heard.
pub(crate) enum Station {
    Own(Space),
    Anothers(Place),
}

/// One of them.
pub(crate) enum Estimates {
    Own(Subscriber<Estimate>),
    Anothers(Reader),
}

/// Why nothing is heard.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Deaf {
    #[error(transparent)]
    Port(#[from] PortError),
    #[error(transparent)]
    Read(#[from] ReadError),
}

/// What has become of a place or a robot.
pub(crate) enum Change {
    Gone,
    Lost(Lost),
}

impl Station {
    /// Takes part as `name` in this user's own place; another's is only looked at.
    pub(crate) fn enter(place: &Place, name: &str) -> Result<Self, OpenError> {
        if Space::is_anothers(&place.root) {
            return Ok(Self::Anothers(place.clone()));
        }
        Space::join(&place.root, &place.prefix, name).map(Self::Own)
    }

    pub(crate) fn hear(&self, robot: &RobotName) -> Result<Estimates, Deaf> {
        Ok(match self {
            Self::Own(space) => Estimates::Own(space.subscriber(robot)?),
            Self::Anothers(place) => Estimates::Anothers(Reader::open(&place.root, robot)?),
        })
    }

    /// The same, without making a channel.
    pub(crate) fn hear_existing(&self, robot: &RobotName) -> Result<Estimates, Deaf> {
        match self {
            Self::Own(space) => Ok(Estimates::Own(space.existing(robot)?)),
            Self::Anothers(_) => self.hear(robot),
        }
    }

    /// Whether `estimates` would still bring something.
    pub(crate) fn check(&self, estimates: &Estimates) -> Option<Change> {
        match (self, estimates) {
            (Self::Own(space), _) => space.check().err().map(Change::Lost),
            (_, Estimates::Anothers(reader)) => reader.check().err().map(|_| Change::Gone),
            _ => None,
        }
    }
}

impl Estimates {
    /// The next one; of another user's robot, the newest. That it has ended is said by [`Station::check`].
    pub(crate) fn receive(&self) -> Result<Option<Estimate>, String> {
        match self {
            Self::Own(subscriber) => subscriber.receive().map_err(|error| error.to_string()),
            Self::Anothers(reader) => match reader.receive() {
                Err(ReadError::Gone { .. }) => Ok(None),
                result => result.map_err(|error| error.to_string()),
            },
        }
    }

    /// What becomes readable, if there is such a thing: for now.
    pub(crate) fn bell(&self) -> Option<BorrowedFd<'_>> {
        match self {
            Self::Own(subscriber) => subscriber.bell().ok(),
            Self::Anothers(reader) => reader.bell().ok(),
        }
    }
}
