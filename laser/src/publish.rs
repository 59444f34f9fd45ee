//! The channels of the robot, and the estimates of the others.

use coloc_sensors::{EndError, Moment};
use coloc_shm_types::{
    Clock, Estimate, Publisher, RelativePose, RobotName, Sender, Sighting, Space, Subscriber,
};

use crate::beliefs::Beliefs;
use crate::driver::Outlet;

/// Its ends of `relative_pose` and `sighting`, and its ears for `estimate`.
#[derive(Debug)]
pub struct Channels {
    poses: Publisher<RelativePose>,
    parts: Publisher<Sighting>,
    /// A sequence for each channel: a gap in it is a loss.
    senders: [Sender; 2],
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
            poses: space.publisher(robot)?,
            parts: space.publisher(robot)?,
            senders: [sender.beside(), sender],
            own: space.subscriber(robot)?,
            others: others?,
        })
    }
}

/// All that has come.
fn heard(estimates: &Subscriber<Estimate>) -> impl Iterator<Item = Estimate> {
    // What cannot be read is as if it had not come: the next one is read anew.
    std::iter::from_fn(|| estimates.receive().ok().flatten())
}

impl Outlet for Channels {
    fn hear(&mut self, beliefs: &mut Beliefs, now: Moment) -> Result<(), EndError> {
        heard(&self.own).for_each(|it| beliefs.hear_own(&it, now));
        for (robot, estimates) in &self.others {
            heard(estimates).for_each(|it| beliefs.hear(*robot, &it, now));
        }
        Ok(())
    }

    fn pose(&mut self, stamp_ns: i64, sighting: RelativePose) -> bool {
        let header = self.senders[0].header(stamp_ns);
        self.poses.send(RelativePose { header, ..sighting }).is_ok()
    }

    fn range_bearing(&mut self, stamp_ns: i64, sighting: Sighting) -> bool {
        let header = self.senders[1].header(stamp_ns);
        self.parts.send(Sighting { header, ..sighting }).is_ok()
    }
}
