//! Algorithm 2: what a sighting of a neighbour says about it in the common frame \[18–29\].

use crate::belief::Belief;
use crate::compose::{Dimension, Displacement, compose};
use crate::covariance::Covariance3;
use crate::honest::{Increments, advance, seen_from};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::settings::{Propagation, Settings};

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

/// [`to_global`] as `settings` have it: what a robot tells the one that it sees.
///
/// With [`FusionSettings::sighting_noise_is_own`](crate::settings::FusionSettings) the whole is the same, and more of it is independent:
/// the error of a sighting is new, and so is its product with the error of the heading. It is correlated with neither
/// of the two, nor with anything that anybody else knows.
#[must_use]
pub fn tell(
    observer: &Belief,
    relative: &Pose,
    covariance: &Covariance3,
    settings: &Settings,
) -> GlobalPose {
    if settings.propagation == Propagation::Honest && settings.fusion.sighting_noise_is_own {
        let (pose, parts) = seen_from(observer, &sighted(relative, covariance));
        return GlobalPose { pose, parts };
    }
    to_global(observer, relative, covariance, settings.propagation)
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
    advance(observer, &sighted(relative, covariance)).belief
}

#[inline]
fn sighted(relative: &Pose, covariance: &Covariance3) -> Increments {
    Increments {
        translation: [relative.x, relative.y],
        turn: relative.phi,
        noise: *covariance,
    }
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
