//! A lever arm: where an antenna is that is not where the body's frame begins.
//!
//! The antenna's position `p + R(φ) l` is not linear in the heading. So the belief is moved to the antenna by a step without noise
//! ([`crate::honest`]), whose moments are exact, a fix is fused there as any other, and the belief is moved back by `−l` at the heading
//! that it has then. Where nothing is learnt in between, both moves cancel: whoever drives back undoes the bend.
//!
//! The paper has no lever arms, so they are turned like this whatever the propagation is; with [`crate::Propagation::Paper`] the next
//! step of the wheels forgets the bend, as it always does.

use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::honest::{Increments, Map, Moved, advance};

/// Whether there is none.
#[inline]
pub(crate) fn is_none([forward, left]: [f64; 2]) -> bool {
    forward == 0.0 && left == 0.0
}

/// The belief of the place `lever` \[m\] away from the body's, `[forward, left]`; without a lever the same, bit for bit.
#[inline]
pub(crate) fn moved(belief: &Belief, lever: [f64; 2]) -> Moved {
    if is_none(lever) {
        return Moved {
            belief: *belief,
            map: Map::default(),
        };
    }
    let way = Increments {
        translation: lever,
        turn: 0.0,
        noise: Covariance3::ZERO,
    };
    advance(belief, &way)
}

/// The lever that leads back.
#[inline]
pub(crate) fn back([forward, left]: [f64; 2]) -> [f64; 2] {
    [-forward, -left]
}
