//! Algorithm 2: what a sighting of a neighbour says about it in the common frame \[18–29\].

use crate::belief::Belief;
use crate::compose::{Dimension, Displacement, compose};
use crate::covariance::Covariance3;
use crate::pose::Pose;

/// A robot's pose in the common frame as a neighbour knows it: the message of Algorithm 2.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct GlobalPose {
    /// y* \[24\].
    pub pose: Pose,
    /// R* \[25\].
    pub total: Covariance3,
    /// R*_i \[28\]; the dependent part is `R*_d = R* − R*_i` \[29\].
    pub independent: Covariance3,
}

/// Algorithm 2: where the observer's `relative` sighting, with noise `covariance` (R), puts the robot it saw.
#[must_use]
pub fn to_global(observer: &Belief, relative: &Pose, covariance: &Covariance3) -> GlobalPose {
    let Pose { x, y, phi } = *relative;
    let sighting = Displacement {
        mean: [x, y, phi],
        noise: covariance.symmetric(),
        dimension: &Dimension::SIX,
    };
    let Belief {
        pose,
        total,
        independent,
    } = compose(observer, &sighting);
    GlobalPose {
        pose,
        total,
        independent,
    }
}
