//! The channels of the robot.

use coloc_sensors::EndError;
use coloc_shm_types::{Clock, Heading, Position, Publisher, RobotName, Sender, Space};

use crate::driver::Outlet;

/// The ends of the channels `position` and `heading`.
#[derive(Debug)]
pub struct Channels {
    position: Publisher<Position>,
    heading: Publisher<Heading>,
    fixes: Sender,
    headings: Sender,
}

impl Channels {
    /// Speaks as the receiver `source` of `robot`, with stamps of `clock`.
    ///
    /// # Errors
    /// If a channel cannot be opened.
    pub fn open(
        space: &Space,
        robot: &RobotName,
        source: u16,
        clock: Clock,
    ) -> Result<Self, EndError> {
        let fixes = Sender::start(source, clock).map_err(|error| EndError::System {
            what: "no random number",
            error,
        })?;
        Ok(Self {
            position: space.publisher(robot)?,
            heading: space.publisher(robot)?,
            headings: fixes.beside(),
            fixes,
        })
    }
}

impl Outlet for Channels {
    fn position(&mut self, stamp_ns: i64, position: Position) -> bool {
        let header = self.fixes.header(stamp_ns);
        self.position.send(Position { header, ..position }).is_ok()
    }

    fn heading(&mut self, stamp_ns: i64, heading: Heading) -> bool {
        let header = self.headings.header(stamp_ns);
        self.heading.send(Heading { header, ..heading }).is_ok()
    }
}
