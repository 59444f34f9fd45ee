//! What becomes of an error: Φ, which a leader says of its own. [`super::bond`] is what a child makes of it.
//!
//! An error goes on by the Jacobian F of each step, and by `I − K H` of each measurement. A leader says what became of its error since
//! each of the last [`TRANSITIONS`] events, so that a child can miss some of them.

use nalgebra::Matrix3;

use crate::belief::Belief;
use crate::covariance::Covariance2;
use crate::factor::Factor;
use crate::symmetric::Symmetric3;

/// So many events back a leader says what became of its error. A child behind a radio that loses half misses eight in a row once in 256
/// times.
pub const TRANSITIONS: usize = 8;

/// The same.
#[allow(clippy::cast_possible_truncation)] // Eight.
pub(super) const SAID: u8 = TRANSITIONS as u8;

/// What became of a leader's error, as it says it at an event.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Past {
    /// Φ from the last event to this one, from the last but one, and so on. Seven digits of them are more than what is linear in it.
    pub transitions: [[[f32; 3]; 3]; TRANSITIONS],
    /// So many of them are said; the others are nothing.
    pub said: u8,
    /// So many events ago, or more if it is 255, the leader's error began to go its way: at a start, or when somebody set the pose. No
    /// transition from before that is one.
    pub known: u8,
}

impl Past {
    /// Φ from so many events ago, at least one.
    pub(super) fn from(&self, events: u8) -> Option<Matrix3<f64>> {
        let place = usize::from(events.checked_sub(1)?);
        let rows = self.transitions.get(place);
        let rows = rows.filter(|_| events <= self.known.min(self.said))?;
        Some(Matrix3::from_fn(|row, column| f64::from(rows[row][column])))
    }

    /// Whether all numbers are some.
    pub(super) fn is_near(&self, farthest: f64) -> bool {
        let mut all = self.transitions.as_flattened().as_flattened().iter();
        all.all(|it| f64::from(it.abs()) <= farthest)
    }
}

/// Φ, as it is said.
#[allow(clippy::cast_possible_truncation)] // It is meant.
pub(super) fn said(by: &Matrix3<f64>) -> [[f32; 3]; 3] {
    by.map(|it| it as f32).transpose().into() // An array of columns is read as one of rows.
}

/// F of a way \[m, m\] in the body frame, from the heading `phi`.
#[must_use]
pub fn driven(phi: f64, [dx, dy]: [f64; 2]) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(phi);
    let mut f = Matrix3::identity();
    f.m13 = -(dx * sin + dy * cos);
    f.m23 = dx * cos - dy * sin;
    f
}

/// `I − K H` of a position with this noise, for the belief `before`.
#[must_use]
pub fn fixed(before: &Belief, noise: &Covariance2) -> Matrix3<f64> {
    let total = before.total();
    let (p, r) = (total.symmetric(), noise.matrix());
    let sum = Symmetric3 {
        xx: p.xx + r.m11,
        xy: p.xy + r.m21,
        yy: p.yy + r.m22,
        ..Symmetric3::ZERO
    };
    let inverse = Factor::new(&sum).inverse();
    let gain = total.matrix() * Matrix3::from(inverse.rows()).transpose();
    Matrix3::identity() - gain
}

/// `I − K H` of a heading with this variance \[rad²\], for the belief `before`.
#[must_use]
pub fn turned(before: &Belief, variance: f64) -> Matrix3<f64> {
    let p = before.total().symmetric();
    let sum = p.pp + variance;
    let mut left = Matrix3::identity();
    if sum > 0.0 {
        left.m13 = -p.xp / sum;
        left.m23 = -p.yp / sum;
        left.m33 = 1.0 - p.pp / sum;
    }
    left
}

/// At a leader.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Transitions {
    since: Matrix3<f64>,
    /// At the last event, of those before it.
    before: [Matrix3<f64>; TRANSITIONS],
    /// How many events there were.
    events: u8,
}

impl Default for Transitions {
    fn default() -> Self {
        Self {
            since: Matrix3::identity(),
            before: [Matrix3::identity(); TRANSITIONS],
            events: 0,
        }
    }
}

impl Transitions {
    /// After a step or a measurement.
    pub fn go_on(&mut self, by: &Matrix3<f64>) {
        self.since = by * self.since;
    }

    /// After what nobody can say as a transition: the pose was set, taken over or read from a file.
    pub fn break_off(&mut self) {
        *self = Self::default();
    }

    /// What it is to say at an event. It is to be called at every event, whether or not a child is seen.
    pub fn at_event(&mut self) -> Past {
        let since = core::mem::replace(&mut self.since, Matrix3::identity());
        let [last, older @ ..] = &mut self.before;
        let mut earlier = core::mem::replace(last, since);
        for it in older {
            earlier = core::mem::replace(it, since * earlier);
        }
        let known = self.events;
        self.events = known.saturating_add(1);
        Past {
            transitions: self.before.each_ref().map(said),
            said: known.min(SAID),
            known,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance3;
    use crate::fix;
    use crate::heading::{self, HeadingNoise};
    use crate::pose::Pose;

    fn step(number: f64) -> Matrix3<f64> {
        driven(number, [0.3 * number, -0.1])
    }

    #[test]
    fn transitions_are_products() {
        let mut leader = Transitions::default();
        let steps: [_; 10] =
            core::array::from_fn(|it| step([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0][it]));
        let mut last = Past::default();
        for (number, it) in (0..).zip(&steps) {
            leader.go_on(it);
            last = leader.at_event();
            assert_eq!(last.known, number);
        }
        let mut product = Matrix3::identity();
        for (events, it) in (1..).zip(steps.iter().rev().take(TRANSITIONS)) {
            product *= it;
            let said = last.from(events).unwrap();
            assert!((said - product).abs().max() < 1e-6, "{events}");
        }
    }

    #[test]
    fn a_child_may_miss_seven_events_and_a_leader_that_starts_anew_has_no_past() {
        let mut leader = Transitions::default();
        let lasts = [(); 11].map(|()| leader.at_event());
        assert_eq!(lasts[0].from(1), None);
        assert!(lasts[3].from(3).is_some() && lasts[3].from(4).is_none());
        assert!(lasts[10].from(8).is_some() && lasts[10].from(9).is_none());
        assert_eq!(lasts[10].from(0), None, "of the same event nobody asks");
        leader.break_off();
        assert_eq!(leader.at_event().from(1), None);
        let forged = Past {
            known: 200,
            said: SAID,
            ..lasts[0]
        };
        assert_eq!(forged.from(SAID + 1), None);
    }

    /// `P⁺ = (I − K H) P`
    #[test]
    fn what_a_measurement_leaves_of_an_error() {
        let rows = [0.04, 0.01, 0.002, 0.01, 0.09, -0.003, 0.002, -0.003, 0.01];
        let p = Covariance3::from_row_major(rows).unwrap();
        let own = Belief::independent(Pose::new(1.0, 2.0, 0.3), p);
        let noise = Covariance2::diagonal([0.01, 0.02]).unwrap();
        let after = fix::update(&own, [1.0, 2.0], &noise, f64::INFINITY).belief;
        let by = fixed(&own, &noise) * p.matrix() - after.total().matrix();
        assert!(by.abs().max() < 1e-15, "{by}");
        let white = HeadingNoise::white(0.002);
        let after = heading::update(&own, 0.3, &white, f64::INFINITY).belief;
        let by = turned(&own, 0.002) * p.matrix() - after.total().matrix();
        assert!(by.abs().max() < 1e-15, "{by}");
    }
}
