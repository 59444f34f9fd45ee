//! A correction that comes after its slot has left the history: to first order.
//!
//! ```text
//! since = Ψ Ψ(s)⁻¹                              what became of what was shared at s
//! x̂ += since (x̂⁺ − x̂(s)),  P −= since (P(s) − P⁺) sinceᵀ,  Ψ := since
//! ```
//!
//! P is what it would be, but for where the fixes since then would have been linearised: their gains are those of P(s), which is a valid gain for
//! P⁺ too. The document of the rounds has the pose 0.4 mm off after a second, and 2.5 mm after four.

use nalgebra::{Matrix3, Vector3};

use super::{Correction, Shared};
use crate::angle::wrap;
use crate::covariance::Covariance3;
use crate::pose::Pose;
use crate::stamp::Span;

/// Nothing older is taken.
pub(crate) const MOST: Span = Span::from_millis(4_000);

/// Of Ψ(s), between the most and the least that it stretches: beyond, its inverse is of no use.
const MOST_CONDITION: f64 = 1e8;

/// What a correction does to whatever has become of what was shared at its slot.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Late {
    /// `Ψ(s)⁻¹`
    back: Matrix3<f64>,
    /// `x̂⁺ − x̂(s)`
    moved: Vector3<f64>,
    /// `P(s) − P⁺`; of a block bound it may be less than nothing.
    learned: Matrix3<f64>,
}

/// Those that the history may still apply, each by its slot.
///
/// Two are enough: the slot of the next one began after this one acted, and has left the history too.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Lates([Option<(u64, Late)>; 2]);

impl Lates {
    pub(crate) fn keep(&mut self, slot: u64, late: Late) {
        let Self([newest, _]) = *self;
        *self = Self([Some((slot, late)), newest.filter(|(last, _)| *last != slot)]);
    }

    pub(crate) fn of(&self, slot: u64) -> Option<&Late> {
        let mut kept = self.0.iter().flatten();
        kept.find(|(of, _)| *of == slot).map(|(_, late)| late)
    }
}

impl Late {
    /// Of what was shared and what a round made of it; `None` where Ψ(s) has no inverse to speak of.
    pub(crate) fn new(shared: &Shared, told: &Correction) -> Option<Self> {
        let back = shared.psi.try_inverse()?;
        let is_sound = shared.psi.norm() * back.norm() <= MOST_CONDITION;
        let Pose { x, y, phi } = shared.pose;
        let turn = wrap(told.pose.phi - phi);
        is_sound.then(|| Self {
            back,
            moved: Vector3::new(told.pose.x - x, told.pose.y - y, turn),
            learned: shared.covariance - told.covariance,
        })
    }

    /// The pose, P and Ψ that it makes of these; `None` if nothing positive is left of P.
    pub(crate) fn apply(
        &self,
        pose: &Pose,
        covariance: &Covariance3,
        psi: &Matrix3<f64>,
    ) -> Option<(Pose, Covariance3, Matrix3<f64>)> {
        let since = psi * self.back;
        let moved = since * self.moved;
        let left = covariance.matrix() - since * self.learned * since.transpose();
        let left = 0.5 * (left + left.transpose());
        left.cholesky()?;
        let pose = Pose::new(pose.x + moved.x, pose.y + moved.y, pose.phi + moved.z);
        let covariance = Covariance3::new(left).ok()?;
        pose.is_finite().then_some((pose, covariance, since))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rounds::Standing;

    fn shared(psi: Matrix3<f64>) -> Shared {
        Shared {
            slot: 1,
            pose: Pose::default(),
            covariance: Matrix3::identity() * 0.04,
            psi,
            standing: Standing::Since(0),
        }
    }

    fn told() -> Correction {
        Correction {
            slot: 1,
            pose: Pose::new(0.1, 0.0, 0.1),
            covariance: Matrix3::identity() * 0.01,
            factor: 1.0,
        }
    }

    #[test]
    fn it_moves_what_became_of_the_belief_as_far_as_that_is_left() {
        let psi = Matrix3::identity() * 0.5;
        let late = Late::new(&shared(psi), &told()).unwrap();
        let now = Covariance3::diagonal([0.04; 3]).unwrap();
        let (pose, covariance, since) = late.apply(&Pose::default(), &now, &(psi * 0.5)).unwrap();
        assert_eq!(pose, Pose::new(0.05, 0.0, 0.05));
        assert!((covariance.matrix() - Matrix3::identity() * 0.0325).norm() < 1e-15);
        assert_eq!(since, Matrix3::identity() * 0.5);
    }

    #[test]
    fn nothing_comes_of_it_where_less_is_left_than_it_takes() {
        let psi = Matrix3::identity();
        let late = Late::new(&shared(psi), &told()).unwrap();
        let now = Covariance3::diagonal([0.03, 0.05, 0.05]).unwrap();
        assert_eq!(late.apply(&Pose::default(), &now, &psi), None);
    }

    #[test]
    fn what_has_been_forgotten_in_one_direction_has_no_way_back() {
        for least in [0.0, 1e-9] {
            let psi = Matrix3::from_diagonal(&[1.0, 1.0, least].into());
            assert_eq!(Late::new(&shared(psi), &told()), None);
        }
    }
}
