//! What a leader says of a child, by what was seen on the way to it.
//!
//! A datum is a [`GlobalPose`]: y*, and R* in two parts. The independent one is what the sightings alone make of it, composed as if the
//! leader knew exactly where it is; the rest is the leader's own error, which all that it ever says has in common.

use nalgebra::Matrix3;

use crate::belief::Belief;
use crate::compose::{Dimension, Displacement, compose};
use crate::convert::GlobalPose;
use crate::covariance::Covariance3;
use crate::honest::{Increments, advance};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::rotate::rotated;
use crate::settings::Propagation;

/// A robot as another one sees it, in that one's body frame.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// z
    pub relative: Pose,
    /// R
    pub covariance: Covariance3,
}

/// The first hop: where a leader's sighting puts the child that it saw.
#[must_use]
pub fn first(leader: &Belief, reading: &Reading, propagation: Propagation) -> GlobalPose {
    let shared = Belief {
        parts: Parts::dependent(leader.total()),
        ..*leader
    };
    composed(&shared, reading, propagation)
}

/// One hop more: where a child's sighting puts the next one, given where `pose` puts that child. Its own belief has no part in it.
#[must_use]
pub fn extend(pose: &GlobalPose, reading: &Reading, propagation: Propagation) -> GlobalPose {
    composed(
        &Belief::gaussian(pose.pose, pose.parts),
        reading,
        propagation,
    )
}

/// Two readings as one: whom `near` sees, seen from where `near` is seen from. So chapter 3 composes, from the leader on.
#[must_use]
pub fn joined(near: &Reading, far: &Reading, propagation: Propagation) -> Reading {
    let start = Belief::independent(near.relative, near.covariance);
    let end = composed(&start, far, propagation);
    Reading {
        relative: end.pose,
        covariance: end.parts.independent,
    }
}

/// Where the robot is that `pose` speaks of, after `way` from there, by its own odometry. The noise of the way is no news to that
/// robot, and two leaders' data go the same way: none of it is independent.
#[must_use]
pub fn carried(pose: &GlobalPose, way: &Reading, propagation: Propagation) -> GlobalPose {
    let exact = Reading {
        covariance: Covariance3::ZERO,
        ..*way
    };
    let moved = extend(pose, &exact, propagation);
    let (sin, cos) = libm::sincos(pose.pose.phi);
    let noise = rotated(&way.covariance.symmetric(), sin, cos);
    let dependent = moved.parts.dependent.symmetric() + noise;
    GlobalPose {
        parts: Parts {
            dependent: Covariance3::trusted(&dependent),
            ..moved.parts
        },
        ..moved
    }
}

/// A way, gone back.
#[must_use]
pub fn reversed(way: &Reading) -> Reading {
    let Pose { x, y, phi } = way.relative;
    let (sin, cos) = libm::sincos(phi);
    let back = Pose::new(-cos * x - sin * y, sin * x - cos * y, -phi);
    // What the turn's error does to the way back is the lever of where it comes to.
    let by = Matrix3::new(
        -cos, -sin, back.y, //
        sin, -cos, -back.x, //
        0.0, 0.0, -1.0,
    );
    let noise = by * way.covariance.matrix() * by.transpose();
    Reading {
        relative: back,
        covariance: Covariance3::new(0.5 * (noise + noise.transpose())).unwrap_or(way.covariance),
    }
}

/// The whole by P, the independent part by `P_i`.
fn composed(from: &Belief, reading: &Reading, propagation: Propagation) -> GlobalPose {
    match propagation {
        Propagation::Paper => by_cubature(from, reading),
        Propagation::Honest => exactly(from, reading),
    }
}

/// By the thesis's twelve points.
fn by_cubature(from: &Belief, reading: &Reading) -> GlobalPose {
    let Pose { x, y, phi } = reading.relative;
    let seen = compose(
        from,
        &Displacement {
            mean: [x, y, phi],
            noise: reading.covariance.symmetric(),
            dimension: &Dimension::SIX,
        },
    );
    GlobalPose {
        pose: seen.pose,
        parts: seen.parts,
    }
}

/// By the moments that Gaussians have in truth.
fn exactly(from: &Belief, reading: &Reading) -> GlobalPose {
    let sight = Increments {
        translation: [reading.relative.x, reading.relative.y],
        turn: reading.relative.phi,
        noise: reading.covariance,
    };
    let whole = advance(from, &sight).belief;
    let alone = Belief::independent(from.pose, from.parts.independent);
    let independent = advance(&alone, &sight).belief.total();
    GlobalPose {
        pose: whole.pose,
        parts: Parts::of(&whole.total(), &independent),
    }
}
