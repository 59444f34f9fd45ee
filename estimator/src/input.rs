//! What a tick hands to the estimator: valid data only, each with the stamp at which it was measured.

use crate::covariance::{Covariance2, Covariance3};
use crate::motion::Motion;
use crate::pose::Pose;
use crate::stamp::Stamp;

/// The number that a robot has in its team's configuration.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RobotId(pub u16);

/// The mean velocity over `(start, stamp]`, as the wheels saw it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct OdometrySample {
    /// Where the interval begins; the stamp of the frame before, for cumulative encoders.
    pub start: Stamp,
    /// Where the interval ends: the stamp of the frame.
    pub stamp: Stamp,
    /// Velocity and its noise per reference period (see [`crate::settings::OdometrySettings`]).
    pub motion: Motion,
}

/// This robot's sighting of another one.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sighting {
    /// When the laser saw it.
    pub stamp: Stamp,
    /// The sensor's count; breaks ties and tells a repetition.
    pub sequence: u64,
    /// Who was seen.
    pub observed: RobotId,
    /// Pose of the observed robot in this robot's body frame.
    pub relative: Pose,
    /// Noise of `relative`, R.
    pub covariance: Covariance3,
}

/// Pose of this robot in the common frame, as a neighbour computed it from its own belief and its sighting of us.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct NeighbourPose {
    /// When the neighbour saw us.
    pub stamp: Stamp,
    /// The sender's count of what it sent to us.
    pub sequence: u64,
    /// Who saw us.
    pub sender: RobotId,
    /// y*, in the common frame.
    pub pose: Pose,
    /// R* = R*_i + R*_d.
    pub total: Covariance3,
    /// R*_i.
    pub independent: Covariance3,
}

/// A satellite fix in the common frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PositionFix {
    /// When the position was valid.
    pub stamp: Stamp,
    /// The receiver's count.
    pub sequence: u64,
    /// `[x, y]` \[m\].
    pub position: [f64; 2],
    /// `R_A` \[m²\].
    pub covariance: Covariance2,
}

/// Everything that reached the robot since the tick before.
#[derive(Copy, Clone, Debug, Default)]
pub struct TickInputs<'a> {
    /// The tick's own stamp: what the estimate will be stamped with.
    pub stamp: Stamp,
    /// In any order.
    pub odometry: &'a [OdometrySample],
    /// In any order.
    pub sightings: &'a [Sighting],
    /// In any order.
    pub neighbours: &'a [NeighbourPose],
    /// In any order.
    pub fixes: &'a [PositionFix],
}
