//! Fusion with the correlation between child and leader tracked: as accurate as the thesis's, and honest.
//!
//! The one thing that successive poses of a leader have in common is that leader's error. The child tracks how it is correlated with its
//! own, `C = E[e_c e_lᵀ]`. The leader says what became of its error since the event before, `e_l := Φ e_l + news`; a step of the child
//! takes C along by its own F.
//!
//! ```text
//! C := C Φᵀ     J = ∂(x_l ⊕ z)/∂x_l = [[1, 0, −(y*_y − x_l,y)], [0, 1, y*_x − x_l,x], [0, 0, 1]]
//! S = P + R_i + J P_l Jᵀ − C Jᵀ − J Cᵀ     K = (P − C Jᵀ) S⁻¹     F = I − K     X = F C Jᵀ Kᵀ
//! x̂ += K ν     P := F P Fᵀ + K (R_i + J P_l Jᵀ) Kᵀ + X + Xᵀ     C_m := F C_m for all leaders m     C_l += K J P_l
//! ```
//!
//! It is exact to first order where the leader's own covariance is, and leaders learn nothing from one another.

use nalgebra::{Matrix3, Vector3};

use super::kalman::innovation;
use crate::belief::Belief;
use crate::clip::positive_part;
use crate::convert::GlobalPose;
use crate::covariance::Covariance3;
use crate::factor::Factor;
use crate::fix::FixUpdate;
use crate::gate::accepts;
use crate::honest;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::symmetric::{Square3, Symmetric3};

/// A child takes a leader's covariance for so many times what the leader says: its errors for twice as large.
///
/// What is in it is tracked all the same, so that a leader that errs up to so much more than it says (wheels, fixes, whatever it is) makes
/// nobody too sure: more noise in an error that goes the same way is no less in any sum. It costs next to no accuracy, as a leader's share
/// in what it says is small beside the sightings', or goes on for long and is not averaged away by either.
pub const DOUBT: f64 = 4.0;

/// What a datum says of its leader.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Leader {
    /// `x_l`, as it was at the event.
    pub pose: Pose,
    /// `P_l`
    pub covariance: Covariance3,
}

impl Leader {
    /// With [`DOUBT`].
    #[must_use]
    pub fn doubted(&self) -> Self {
        Self {
            covariance: self.covariance.scaled(DOUBT),
            ..*self
        }
    }
}

/// Result of [`update`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Crossed {
    /// As of any pose. What is left of the belief is all dependent: a leader's error is in it.
    pub update: FixUpdate,
    /// `I − K`: what is left of C of every leader; the unit matrix if the gate refused.
    pub left: Matrix3<f64>,
    /// `K J P_l`, which comes to C of this leader.
    pub gained: Matrix3<f64>,
}

impl Crossed {
    /// C of this leader, of what it was before.
    #[must_use]
    pub fn with_this(&self, before: &Matrix3<f64>) -> Matrix3<f64> {
        self.left * before + self.gained
    }

    /// C of any other leader.
    #[must_use]
    pub fn with_other(&self, before: &Matrix3<f64>) -> Matrix3<f64> {
        self.left * before
    }

    /// A datum that the gate refuses.
    pub(super) fn refused(own: &Belief, d2: f64) -> Self {
        Self {
            update: FixUpdate {
                belief: *own,
                accepted: false,
                d2,
            },
            left: Matrix3::identity(),
            gained: Matrix3::zeros(),
        }
    }
}

/// `own` after a datum of a leader with which its error has the covariance `cross` (C, at the event).
///
/// A C that no two errors can have is refused as a pose beyond the gate is.
#[must_use]
pub fn update(
    own: &Belief,
    cross: &Matrix3<f64>,
    leader: &Leader,
    said: &GlobalPose,
    gate: f64,
) -> Crossed {
    let terms = Terms::new(own, cross, leader, said);
    let (inverse, d2) = terms.normalised(innovation(&own.pose, &said.pose));
    let refused = Crossed::refused(own, d2);
    if !(accepts(d2, gate) && d2 >= 0.0) {
        return refused;
    }
    let gain = (terms.own - terms.seen_cross) * inverse;
    let Some(belief) = terms.belief(own, &gain, said) else {
        return refused;
    };
    Crossed {
        update: FixUpdate {
            belief,
            accepted: true,
            d2,
        },
        left: Matrix3::identity() - gain,
        gained: gain * terms.said_by,
    }
}

/// `said` with all that is in it besides the sightings and the leader's error: the ways that robots in between carried it by their own
/// wheels. Of `leaders` data each can have gone the same way, so each of them counts that many times.
///
/// ```text
/// R_i + L (R_d − J P_l Jᵀ)
/// ```
pub(crate) fn with_ways(said: &GlobalPose, leader: &Leader, leaders: u8) -> GlobalPose {
    let by_leader = by_leader(leader, said);
    let own = by_leader * leader.covariance.matrix() * by_leader.transpose();
    let rest = said.parts.dependent.matrix() - own;
    let Some(rest) = covariance(&rest).or_else(|| clipped(&rest)) else {
        return *said;
    };
    let independent = said.parts.independent;
    GlobalPose {
        parts: Parts {
            independent: independent.plus(&rest.scaled(f64::from(leaders))),
            ..said.parts
        },
        ..*said
    }
}

/// What is below zero by rounding, or by what is not linear, is nothing.
fn clipped(rest: &Matrix3<f64>) -> Option<Covariance3> {
    let rows = 0.5 * (rest + rest.transpose());
    let symmetric = Symmetric3 {
        xx: rows.m11,
        xy: rows.m12,
        xp: rows.m13,
        yy: rows.m22,
        yp: rows.m23,
        pp: rows.m33,
    };
    let clipped = Covariance3::trusted(&positive_part(&symmetric));
    clipped
        .variances()
        .iter()
        .all(|it| it.is_finite())
        .then_some(clipped)
}

/// `J`
fn by_leader(leader: &Leader, said: &GlobalPose) -> Matrix3<f64> {
    let (dx, dy) = (said.pose.x - leader.pose.x, said.pose.y - leader.pose.y);
    Matrix3::new(1.0, 0.0, -dy, 0.0, 1.0, dx, 0.0, 0.0, 1.0)
}

struct Terms {
    /// P
    own: Matrix3<f64>,
    /// `C Jᵀ`
    seen_cross: Matrix3<f64>,
    /// `J P_l`
    said_by: Matrix3<f64>,
    /// `R_i + J P_l Jᵀ`
    noise: Matrix3<f64>,
}

impl Terms {
    fn new(own: &Belief, cross: &Matrix3<f64>, leader: &Leader, said: &GlobalPose) -> Self {
        let by_leader = by_leader(leader, said);
        let said_by = by_leader * leader.covariance.matrix();
        Self {
            own: own.total().matrix(),
            seen_cross: cross * by_leader.transpose(),
            said_by,
            noise: said.parts.independent.matrix() + said_by * by_leader.transpose(),
        }
    }

    /// `S⁻¹` and d²; no number where S is none of a covariance.
    fn normalised(&self, innovation: [f64; 3]) -> (Matrix3<f64>, f64) {
        let sum = self.own + self.noise - self.seen_cross - self.seen_cross.transpose();
        let Some(sum) = covariance(&sum) else {
            return (Matrix3::zeros(), f64::NAN);
        };
        let factor = Factor::new(&sum.symmetric());
        let inverse = Covariance3::trusted(&factor.inverse()).matrix();
        (inverse, factor.distance(innovation))
    }

    fn belief(&self, own: &Belief, gain: &Matrix3<f64>, said: &GlobalPose) -> Option<Belief> {
        let left = Matrix3::identity() - gain;
        let crossed = left * self.seen_cross * gain.transpose();
        let total = covariance(
            &(left * self.own * left.transpose()
                + gain * self.noise * gain.transpose()
                + crossed
                + crossed.transpose()),
        )?;
        let step = gain * Vector3::from(innovation(&own.pose, &said.pose));
        let (before, after) = (own.heading_variance(), total.symmetric().pp);
        let complement = Square3(left.transpose().into());
        let (_, bend) = honest::left(&own.parts.dependent.symmetric(), &own.bend, &complement);
        let belief = Belief {
            pose: Pose::new(
                own.pose.x + step.x,
                own.pose.y + step.y,
                own.pose.phi + step.z,
            ),
            parts: Parts::dependent(total),
            bend: bend.shrunk(before, after),
        };
        belief.is_finite().then_some(belief)
    }
}

/// What was computed, its rounding taken from both sides of the diagonal; `None` if it is none.
fn covariance(matrix: &Matrix3<f64>) -> Option<Covariance3> {
    Covariance3::new(0.5 * (matrix + matrix.transpose())).ok()
}
