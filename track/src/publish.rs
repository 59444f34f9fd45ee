//! What of a track may be told: what it knows well enough, and no more.

use nalgebra::Matrix3;

use crate::manager::{Status, Track};
use crate::state::{Core, State};

/// A heading less certain than this is not told \[rad\].
const HEADING_SIGMA: f64 = 0.35;

/// A position less certain than this is not told with a heading \[m\].
const POSITION_SIGMA_M: f64 = 0.5;

/// What `relative_pose` says where there is no heading \[rad²\].
const NO_HEADING: f64 = 1e4;

/// What of a track may be told.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Published {
    /// Nothing.
    Nothing,
    /// The position alone.
    Position(State),
    /// Position and heading.
    Pose(State),
}

/// What of `track` may be told: nothing while it is tentative, no heading that is not known.
#[must_use]
pub fn publish(track: &Track) -> Published {
    let state = track.state;
    if track.status == Status::Tentative {
        return Published::Nothing;
    }
    let is_turned =
        state.core == Core::Heading && state.covariance[(2, 2)] < HEADING_SIGMA * HEADING_SIGMA;
    if is_turned && state.position_sigma() < POSITION_SIGMA_M {
        Published::Pose(state)
    } else {
        Published::Position(state)
    }
}

impl State {
    /// Pose and covariance as `relative_pose` takes them. That payload has no other way to say that there is no heading.
    #[must_use]
    pub fn relative_pose(&self) -> ([f64; 3], Matrix3<f64>) {
        let position = self.position();
        match self.core {
            Core::Heading => {
                let covariance = self.covariance.fixed_view::<3, 3>(0, 0).into_owned();
                ([position.x, position.y, self.mean[2]], covariance)
            }
            Core::Linear => {
                let mut covariance = Matrix3::zeros();
                covariance
                    .fixed_view_mut::<2, 2>(0, 0)
                    .copy_from(&self.position_covariance());
                covariance.m33 = NO_HEADING;
                ([position.x, position.y, 0.0], covariance)
            }
        }
    }
}
