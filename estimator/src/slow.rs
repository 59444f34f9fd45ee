//! A fix with a slow error: split covariance intersection, its slow part dependent on what the belief knows of the receiver before.

use crate::belief::Belief;
use crate::convert::GlobalPose;
use crate::covariance::{Covariance2, Covariance3};
use crate::fusion::fuse_and_leave;
use crate::kind::{PositionFix, SlowError};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::settings::FusionSettings;
use crate::stamp::Span;
use crate::symmetric::{Square3, Symmetric3};

/// Of a heading that was not measured \[rad²\]: the gain in it is nothing, to rounding.
const UNMEASURED: f64 = 1e9;

/// The belief gives up no more than half of itself for a fix.
const MOST_DAMPING: f64 = 0.5;

/// A belief more uncertain than so many fixes learns as fast as within a second.
const UNCERTAIN: f64 = 8.0;
const EAGER_S: f64 = 1.0;

/// `own` after a fix that its gate accepts, `since` the last one with a slow error: `R_i` is the white noise, `R_d` the slow error, and
/// β is the part of the error's memory that has passed; and what it leaves of the error before.
pub(crate) fn update(
    own: &Belief,
    fix: &PositionFix,
    since: Span,
    settings: &FusionSettings,
) -> (Belief, Square3) {
    let [x, y] = fix.position;
    let received = GlobalPose {
        pose: Pose {
            x,
            y,
            phi: own.pose.phi,
        },
        parts: split(&fix.covariance, &fix.slow),
    };
    let settings = FusionSettings {
        damping: damping(own, &fix.covariance, &fix.slow, since),
        gate: f64::INFINITY,
        ..*settings
    };
    let mut left = Square3::IDENTITY;
    let fusion = fuse_and_leave(own, &received, &settings, &mut left);
    (fusion.belief, left)
}

fn damping(own: &Belief, white: &Covariance2, slow: &SlowError, since: Span) -> f64 {
    let [x, y, _] = own.total().variances();
    let [wx, wy] = white.variances();
    let is_uncertain = x + y > UNCERTAIN * (0.5 * (wx + wy) + slow.variance);
    let memory_s = if is_uncertain {
        EAGER_S.min(slow.memory.as_seconds())
    } else {
        slow.memory.as_seconds()
    };
    (since.as_seconds() / memory_s).clamp(0.0, MOST_DAMPING)
}

fn split(white: &Covariance2, slow: &SlowError) -> Parts {
    let white = white.matrix();
    let independent = Symmetric3 {
        xx: white.m11,
        xy: white.m21,
        yy: white.m22,
        pp: UNMEASURED,
        ..Symmetric3::ZERO
    };
    Parts {
        independent: Covariance3::trusted(&independent),
        dependent: Covariance3::clamped_diagonal([slow.variance, slow.variance, 0.0]),
    }
}
