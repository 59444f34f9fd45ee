//! Algorithm 2: what a sighting of a neighbour says about it in the common frame \[18–29\].

use crate::belief::Belief;
use crate::compose::{Dimension, Displacement, compose};
use crate::covariance::Covariance3;
use crate::honest::{Increments, advance};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::settings::Propagation;

/// A robot's pose in the common frame as a neighbour knows it: the message of Algorithm 2.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct GlobalPose {
    /// y* \[24\].
    pub pose: Pose,
    /// R* \[25\] in its parts: R*_i \[28\] and R*_d \[29\].
    pub parts: Parts,
}

impl GlobalPose {
    /// R*
    #[must_use]
    pub fn total(&self) -> Covariance3 {
        self.parts.total()
    }
}

/// Algorithm 2: where the observer's `relative` sighting, with noise `covariance` (R), puts the robot it saw.
#[must_use]
pub fn to_global(
    observer: &Belief,
    relative: &Pose,
    covariance: &Covariance3,
    propagation: Propagation,
) -> GlobalPose {
    let seen = match propagation {
        Propagation::Honest => seen_honestly(observer, relative, covariance),
        Propagation::Paper => seen_by_cubature(observer, relative, covariance),
    };
    GlobalPose {
        pose: seen.pose,
        parts: seen.parts,
    }
}

/// The step of [`crate::honest`] by what was seen.
#[inline]
fn seen_honestly(observer: &Belief, relative: &Pose, covariance: &Covariance3) -> Belief {
    let sighting = Increments {
        translation: [relative.x, relative.y],
        turn: relative.phi,
        noise: *covariance,
    };
    advance(observer, &sighting).belief
}

fn seen_by_cubature(observer: &Belief, relative: &Pose, covariance: &Covariance3) -> Belief {
    let Pose { x, y, phi } = *relative;
    let sighting = Displacement {
        mean: [x, y, phi],
        noise: covariance.symmetric(),
        dimension: &Dimension::SIX,
    };
    compose(observer, &sighting)
}
