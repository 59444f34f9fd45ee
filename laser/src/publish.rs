//! The channels of the robot, and the estimates of the others.

use coloc_scan::finder::RangeBearing;
use coloc_sensors::{EndError, Moment};
use coloc_shm_types::{
    Clock, Estimate, Publisher, RelativePose, RobotName, Sender, Space, Subscriber,
};

use crate::beliefs::Beliefs;
use crate::driver::Outlet;

/// Its end of `relative_pose`, and its ears for `estimate`.
#[derive(Debug)]
pub struct Channels {
    sightings: Publisher<RelativePose>,
    sender: Sender,
    own: Subscriber<Estimate>,
    others: Vec<(u16, Subscriber<Estimate>)>,
}

impl Channels {
    /// Speaks as the scanner `source` of `robot`, and listens to it and to `others`.
    ///
    /// # Errors
    /// If a channel cannot be opened.
    pub fn open(
        space: &Space,
        robot: &RobotName,
        source: u16,
        others: &[(u16, RobotName)],
    ) -> Result<Self, EndError> {
        let sender = Sender::start(source, Clock::Boottime).map_err(|error| EndError::System {
            what: "no random number",
            error,
        })?;
        let listen = |(number, name): &(u16, RobotName)| Ok((*number, space.subscriber(name)?));
        let others: Result<_, EndError> = others.iter().map(listen).collect();
        Ok(Self {
            sightings: space.publisher(robot)?,
            sender,
            own: space.subscriber(robot)?,
            others: others?,
        })
    }
}

/// The newest of what has come.
fn newest(estimates: &Subscriber<Estimate>) -> Option<Estimate> {
    let mut newest = None;
    // What cannot be read is as if it had not come: the next one is read anew.
    while let Ok(Some(estimate)) = estimates.receive() {
        newest = Some(estimate);
    }
    newest
}

impl Outlet for Channels {
    fn hear(&mut self, beliefs: &mut Beliefs, now: Moment) -> Result<(), EndError> {
        if let Some(estimate) = newest(&self.own) {
            beliefs.hear_own(&estimate, now);
        }
        for (robot, estimates) in &self.others {
            if let Some(estimate) = newest(estimates) {
                beliefs.hear(*robot, &estimate, now);
            }
        }
        Ok(())
    }

    fn pose(&mut self, stamp_ns: i64, sighting: RelativePose) -> bool {
        let header = self.sender.header(stamp_ns);
        self.sightings
            .send(RelativePose { header, ..sighting })
            .is_ok()
    }

    /// It is not on the channel `sighting` yet; this is where it will go.
    fn range_bearing(&mut self, _: i64, _: u16, _: &RangeBearing) -> Option<bool> {
        None
    }
}
