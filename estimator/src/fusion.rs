//! Algorithm 3: split covariance intersection of the own belief with a neighbour's word \[30–37\].
//!
//! ```text
//! P₁ = P_d/α + P_i ;  P₂ = R_d/(1−α) + R_i ;  K = P₁ (P₁+P₂)⁻¹
//! x̂⁺ = x̂ + K ν ;  P_i⁺ = (I−K) P_i (I−K)ᵀ + K R_i Kᵀ
//! P_d⁺ = (I−K) (P_d/α) (I−K)ᵀ + K (R_d/(1−α)) Kᵀ
//! ```
//!
//! Both parts are positive semidefinite by construction; their sum is `P⁺ = (I−K) P₁`.

use crate::angle::wrap;
use crate::belief::Belief;
use crate::convert::GlobalPose;
use crate::covariance::Covariance3;
use crate::factor::Factor;
use crate::gate::accepts;
use crate::honest::{self, Bend};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::settings::{FusionSettings, GateWeight};
use crate::split::Split;
use crate::symmetric::{Square3, Symmetric3};
use crate::weight::{Weights, optimal};

/// Stands for zero where a dependent part is singular and the result is a limit that has no closed form.
const NEXT_TO_ZERO: f64 = 1e-9;

/// Result of [`fuse`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Fusion {
    /// The belief afterwards; the one before, bit for bit, if the gate refused.
    pub belief: Belief,
    /// Whether the pose passed the gate.
    pub accepted: bool,
    /// The weight α ∈ [0, 1] of the update, after damping. 0 where `P_d = 0`, else 1 where `R_d = 0`.
    pub alpha: f64,
    /// Normalised innovation squared, at the weight that [`FusionSettings::gate_weight`] names.
    pub d2: f64,
}

/// Algorithm 3: `own` after hearing `received`; β is the settings' damping ([`crate::Pace::damped`] gives that of the moment).
///
/// A dependent part that is zero is not divided by its weight, nor is the weight damped then; if both are, this
/// is the Kalman filter's update. If neither covariance has an independent part, it is covariance intersection.
#[must_use]
pub fn fuse(own: &Belief, received: &GlobalPose, settings: &FusionSettings) -> Fusion {
    let mut left = Square3::IDENTITY;
    fuse_and_leave(own, received, settings, &mut left)
}

/// [`fuse`]; where it accepts, `left` becomes `I − K`: what is left of the error before.
#[inline]
pub(crate) fn fuse_and_leave(
    own: &Belief,
    received: &GlobalPose,
    settings: &FusionSettings,
    left: &mut Square3,
) -> Fusion {
    let prior = Split::new(&own.parts);
    let message = Split::new(&received.parts);
    let innovation = innovation(&own.pose, &received.pose);
    let (alpha, weights) = choose(&prior, &message, settings);
    let inverse = Factor::new(&weights.combine(&prior, &message)).inverse();
    let d2 = match settings.gate_weight {
        GateWeight::Half if !(prior.is_independent || message.is_independent) => {
            half_d2(&prior, &message, innovation)
        }
        _ => weights.own * weights.received * inverse.quadratic(innovation),
    };
    if !accepts(d2, settings.gate) {
        return Fusion {
            belief: *own,
            accepted: false,
            alpha,
            d2,
        };
    }
    let gains = Gains::new((&prior, &own.bend), &message, weights, &inverse);
    let belief = gains.update(own, innovation, &prior, &message);
    let accepted = belief.is_finite();
    if accepted {
        *left = gains.complement;
    }
    Fusion {
        belief: if accepted { belief } else { *own },
        accepted,
        alpha,
        d2,
    }
}

/// `ν = y* − x̂`, heading wrapped \[33\].
#[inline]
fn innovation(own: &Pose, received: &Pose) -> [f64; 3] {
    [
        received.x - own.x,
        received.y - own.y,
        wrap(received.phi - own.phi),
    ]
}

/// d² at α = ½, `S = (P₁ + P₂) = 4 M`.
fn half_d2(prior: &Split, message: &Split, innovation: [f64; 3]) -> f64 {
    let half = Weights {
        own: 0.5,
        received: 0.5,
    };
    0.25 * Factor::new(&half.combine(prior, message))
        .inverse()
        .quadratic(innovation)
}

/// α, and the weights to compute with.
fn choose(prior: &Split, message: &Split, settings: &FusionSettings) -> (f64, Weights) {
    if prior.is_independent || message.is_independent {
        // What is zero needs no weight, and the other part's is one: P_d/α := 0 or R_d/(1−α) := 0.
        let alpha = if prior.is_independent { 0.0 } else { 1.0 };
        return (
            alpha,
            Weights {
                own: 1.0,
                received: 1.0,
            },
        );
    }
    let lever = settings.heading_lever_m;
    let best = optimal(
        &prior.with_heading_in_metres(lever),
        &message.with_heading_in_metres(lever),
        settings.criterion,
    );
    let damping = settings.damping.clamp(0.0, 1.0);
    let weights = Weights {
        own: best.own + (1.0 - damping) * best.received,
        received: damping * best.received,
    };
    (weights.own, inside(weights, prior, message))
}

/// At an end the part with weight zero is ignored altogether, if it is regular. If not, it still says something
/// about some direction, and that limit is taken numerically.
fn inside(weights: Weights, prior: &Split, message: &Split) -> Weights {
    if weights.own == 0.0 && !prior.is_regular() {
        return Weights {
            own: NEXT_TO_ZERO,
            received: 1.0 - NEXT_TO_ZERO,
        };
    }
    if weights.received == 0.0 && !message.is_regular() {
        return Weights {
            own: 1.0 - NEXT_TO_ZERO,
            received: NEXT_TO_ZERO,
        };
    }
    weights
}

/// The gain with all that is multiplied by it.
struct Gains {
    /// K
    gain: Square3,
    /// I − K
    complement: Square3,
    /// `(I−K) (P_d/α) (I−K)ᵀ + K (R_d/(1−α)) Kᵀ`
    dependent: Symmetric3,
    /// `(I−K) K_H`
    bend: Bend,
}

impl Gains {
    /// From `M⁻¹`. `K = (1−α) A M⁻¹` and `I−K = α B M⁻¹`: the smaller one is computed, so that both ends are exact.
    #[inline]
    fn new(
        (prior, bend): (&Split, &Bend),
        message: &Split,
        weights: Weights,
        inverse: &Symmetric3,
    ) -> Self {
        let Weights { own, received } = weights;
        if own >= 0.5 {
            let per_weight = prior.bound(own).times(inverse);
            let gain = per_weight.scaled(received);
            let complement = gain.complement();
            let (left, bend) = honest::left(&prior.dependent, bend, &complement);
            let dependent =
                left * (1.0 / own) + per_weight.congruence(&message.dependent) * received;
            return Self {
                gain,
                complement,
                dependent,
                bend,
            };
        }
        let per_weight = message.bound(received).times(inverse);
        let complement = per_weight.scaled(own);
        let gain = complement.complement();
        let (left, bend) = honest::left(&prior.dependent, bend, &per_weight);
        let dependent = left * own + gain.congruence(&message.dependent) * (1.0 / received);
        Self {
            gain,
            complement,
            dependent,
            bend: bend.mapped(|k| k.map(|it| own * it)),
        }
    }

    /// \[35–37\], in parts; the bend shrinks ([`crate::honest`]).
    #[inline]
    fn update(&self, own: &Belief, innovation: [f64; 3], prior: &Split, message: &Split) -> Belief {
        let [dx, dy, dphi] = self.gain.apply(innovation);
        let independent = self.complement.congruence(&prior.independent)
            + self.gain.congruence(&message.independent);
        let (before, after) = (own.heading_variance(), independent.pp + self.dependent.pp);
        let Pose { x, y, phi } = own.pose;
        Belief {
            pose: Pose::new(x + dx, y + dy, phi + dphi),
            parts: Parts {
                independent: Covariance3::trusted(&independent),
                dependent: Covariance3::trusted(&self.dependent),
            },
            bend: self.bend.shrunk(before, after),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At an end the other part's weight is next to zero, and together they are one as anywhere else.
    #[test]
    fn weights_are_one_together_at_the_ends_too() {
        let flat = Covariance3::diagonal([1.0, 0.0, 0.0]).unwrap();
        let flat = Split::new(&Parts::dependent(flat));
        for (own, received) in [(0.0, 1.0), (1.0, 0.0), (0.25, 0.75)] {
            let weights = inside(Weights { own, received }, &flat, &flat);
            assert!(weights.own > 0.0 && weights.received > 0.0);
            assert!((weights.own + weights.received - 1.0).abs() < 1e-15);
            assert!((weights.own - own).abs() < 1e-8);
        }
    }
}
