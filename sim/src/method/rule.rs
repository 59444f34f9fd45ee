//! The one thing in which the decentralized estimators differ.

use coloc_estimator::convert::GlobalPose;
use coloc_estimator::fusion::{Fusion, fuse};
use coloc_estimator::settings::{Criterion, FusionSettings};
use coloc_estimator::{Belief, Pace, Parts, Settings};

use super::ellipsoidal;

/// What a robot does with a pose received from a neighbour.
///
/// Naive Bayes and covariance intersection are the two ends of split covariance intersection: everything
/// independent, nothing independent. So all of them run through the product's own [`fuse`].
#[derive(Copy, Clone, Debug)]
pub enum Rule {
    /// Ignores it.
    Single,
    /// Takes everything as independent: `P_i = P`, `R_i = R`.
    Naive(FusionSettings),
    /// Takes nothing as independent: `P_i = R_i = 0`.
    Intersection(FusionSettings),
    /// Ellipsoidal intersection, accepted if d² of `P + R` is at most this.
    Ellipsoidal {
        /// χ² quantile.
        gate: f64,
    },
    /// Keeps the books: `P_i` as propagated, `R_i` as received.
    Split(FusionSettings),
}

impl Rule {
    /// Naive Bayes with the product's gate.
    #[must_use]
    pub fn naive(product: &Settings) -> Self {
        Self::Naive(paper(product))
    }

    /// Covariance intersection with the product's gate.
    #[must_use]
    pub fn intersection(product: &Settings, criterion: Criterion) -> Self {
        Self::Intersection(FusionSettings {
            criterion,
            ..paper(product)
        })
    }

    /// Ellipsoidal intersection with the product's gate.
    #[must_use]
    pub fn ellipsoidal(product: &Settings) -> Self {
        Self::Ellipsoidal {
            gate: product.fusion.gate,
        }
    }

    /// The paper's split covariance intersection with the product's gate.
    #[must_use]
    pub fn paper(product: &Settings) -> Self {
        Self::Split(paper(product))
    }

    /// Split covariance intersection with β = 0.2, whatever the rate of messages, and reset on transmit.
    #[must_use]
    pub fn damped(product: &Settings) -> Self {
        Self::Split(FusionSettings {
            damping: 0.2,
            reset_on_transmit: true,
            ..paper(product)
        })
    }

    /// `own` after hearing `received`.
    #[must_use]
    pub fn fuse(&self, own: &Belief, received: &GlobalPose, pace: &Pace) -> Fusion {
        let received = GlobalPose {
            parts: self.claim(&received.parts),
            ..*received
        };
        match self {
            Self::Single => Fusion {
                belief: *own,
                accepted: false,
                alpha: 1.0,
                d2: 0.0,
            },
            Self::Naive(settings) | Self::Intersection(settings) | Self::Split(settings) => {
                fuse(&self.books(own), &received, &pace.damped(settings))
            }
            Self::Ellipsoidal { gate } => ellipsoidal::fuse(own, &received, *gate),
        }
    }

    /// The belief with `P_i` as this rule sees it.
    #[must_use]
    pub fn books(&self, belief: &Belief) -> Belief {
        Belief {
            parts: self.claim(&belief.parts),
            ..*belief
        }
    }

    /// What this rule takes as independent.
    fn claim(&self, parts: &Parts) -> Parts {
        match self {
            Self::Naive(_) => Parts::independent(parts.total()),
            Self::Single | Self::Intersection(_) | Self::Ellipsoidal { .. } => {
                Parts::dependent(parts.total())
            }
            Self::Split(_) => *parts,
        }
    }

    /// Whether `P_i := 0` after an exchange in which something was `received` or `sent`.
    #[must_use]
    pub fn makes_dependent(&self, received: bool, sent: bool) -> bool {
        match self {
            Self::Split(settings) => received || (settings.reset_on_transmit && sent),
            _ => false,
        }
    }

    /// Whether robots talk at all.
    #[must_use]
    pub fn talks(&self) -> bool {
        !matches!(self, Self::Single)
    }
}

/// The paper's fusion, with the gate of `product`.
fn paper(product: &Settings) -> FusionSettings {
    FusionSettings {
        gate: product.fusion.gate,
        gate_weight: product.fusion.gate_weight,
        ..FusionSettings::paper()
    }
}
