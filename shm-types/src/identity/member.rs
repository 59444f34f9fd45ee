//! Who may speak to a robot, and of whom.
use crate::{Limits, Reject};

impl Limits<'_> {
    /// That `robot` is of the team.
    pub(crate) fn check_member(&self, robot: u16) -> Result<(), Reject> {
        if self.robots.contains(&robot) {
            Ok(())
        } else {
            Err(Reject::UnknownRobot)
        }
    }

    /// That `robot` is of the team and somebody else.
    pub(crate) fn check_other(&self, robot: u16) -> Result<(), Reject> {
        if robot == self.own {
            Err(Reject::UnknownRobot)
        } else {
            self.check_member(robot)
        }
    }
}
