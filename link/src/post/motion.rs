//! How the own robot moves: what a doubt about stamps means for what is told of it.
use coloc_shm_types::{Estimate, PortError, RobotName, Space, Subscriber};

use crate::clock_offset::blur;

/// Listens to the own robot's estimates.
#[derive(Debug)]
pub(super) struct Motion {
    estimates: Subscriber<Estimate>,
    last: Option<Estimate>,
}

impl Motion {
    pub(super) fn open(space: &Space, robot: &RobotName) -> Result<Self, PortError> {
        Ok(Self {
            estimates: space.subscriber(robot)?,
            last: None,
        })
    }

    /// What a doubt of `variance_s2` about a stamp adds to a pose of the own robot (3×3; m², m·rad, rad²): nothing while there is no
    /// estimate, since a robot without one uses no pose that it is told.
    pub(super) fn blur(&mut self, variance_s2: f64) -> [f64; 9] {
        while let Ok(Some(estimate)) = self.estimates.receive() {
            self.last = Some(estimate);
        }
        self.last.map_or([0.0; 9], |last| {
            let [_, _, heading_rad] = last.pose;
            blur(last.velocity, heading_rad, variance_s2)
        })
    }
}
