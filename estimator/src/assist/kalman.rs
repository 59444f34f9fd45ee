//! A whole pose as a measurement: a Kalman update with `H = I₃`, the innovation's heading wrapped.

use crate::angle::wrap;
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::factor::Factor;
use crate::fix::FixUpdate;
use crate::gate::accepts;
use crate::honest;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::symmetric::{Square3, Symmetric3};

/// `own` after a `pose` with noise `covariance` (R), if d² ≤ `gate` (χ², three degrees of freedom; infinite accepts everything).
///
/// The gate uses `P + R`; both parts are updated in Joseph's form with the gain of P, and the bend shrinks ([`crate::honest`]).
#[must_use]
pub fn update(own: &Belief, pose: &Pose, covariance: &Covariance3, gate: f64) -> FixUpdate {
    let total = own.total().symmetric();
    let noise = covariance.symmetric();
    let factor = Factor::new(&(total + noise));
    let innovation = innovation(&own.pose, pose);
    let d2 = factor.distance(innovation);
    let refused = FixUpdate {
        belief: *own,
        accepted: false,
        d2,
    };
    if !accepts(d2, gate) {
        return refused;
    }
    let gain = total.times(&factor.inverse());
    let belief = updated(own, &gain, innovation, &noise);
    if !belief.is_finite() {
        return refused;
    }
    FixUpdate {
        belief,
        accepted: true,
        d2,
    }
}

/// `y − x̂`
pub(super) fn innovation(own: &Pose, said: &Pose) -> [f64; 3] {
    [said.x - own.x, said.y - own.y, wrap(said.phi - own.phi)]
}

fn updated(own: &Belief, gain: &Square3, innovation: [f64; 3], noise: &Symmetric3) -> Belief {
    let complement = gain.complement();
    let brought = gain.congruence(noise);
    let independent = complement.congruence(&own.parts.independent.symmetric()) + brought;
    let dependent = own.parts.dependent.symmetric();
    let (dependent, bend) = honest::left(&dependent, &own.bend, &complement);
    let after = independent.pp + dependent.pp;
    let [dx, dy, dphi] = gain.apply(innovation);
    let Pose { x, y, phi } = own.pose;
    Belief {
        pose: Pose::new(x + dx, y + dy, phi + dphi),
        parts: Parts {
            independent: Covariance3::trusted(&independent),
            dependent: Covariance3::trusted(&dependent),
        },
        bend: bend.shrunk(own.heading_variance(), after),
    }
}
