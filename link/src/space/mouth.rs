//! Saying on a channel what came as bytes.
use std::fmt;

use coloc_shm_types::{Channel, Message, OnPayload, PortError, Publisher, RobotName, Space};

/// Speaks on a channel of a robot.
pub struct Mouth(Box<dyn Port>);

impl Mouth {
    /// Speaks on that robot's channel.
    ///
    /// # Errors
    /// If the channel cannot be opened.
    pub fn open(space: &Space, robot: &RobotName, channel: Channel) -> Result<Self, PortError> {
        channel.with_payload(Open { space, robot }).map(Self)
    }

    /// Says it; whether these bytes are the channel's payload, and it reached everybody who listens.
    #[must_use]
    pub fn say(&self, bytes: &[u8]) -> bool {
        self.0.say(bytes)
    }
}

impl fmt::Debug for Mouth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Mouth").finish_non_exhaustive()
    }
}

trait Port {
    fn say(&self, bytes: &[u8]) -> bool;
}

impl<M: Message> Port for Publisher<M> {
    fn say(&self, bytes: &[u8]) -> bool {
        M::from_plain(bytes).is_some_and(|message| self.send(message).is_ok())
    }
}

struct Open<'a> {
    space: &'a Space,
    robot: &'a RobotName,
}

impl OnPayload for Open<'_> {
    type Out = Result<Box<dyn Port>, PortError>;

    fn on<M: Message>(self) -> Self::Out {
        let port = self.space.publisher::<M>(self.robot)?;
        Ok(Box::new(port))
    }
}
