//! What becomes of an error: Φ, which a leader says of its own, and C, which a child keeps of it.
//!
//! An error goes on by the Jacobian F of each step, and by `I − K H` of each measurement. A leader says what became of its error since
//! each of the last [`TRANSITIONS`] events, so that a child can miss some of them.

use nalgebra::Matrix3;

use super::slot::Slot;
use crate::belief::Belief;
use crate::covariance::Covariance2;
use crate::factor::Factor;
use crate::symmetric::Symmetric3;

/// So many events back a leader says what became of its error.
pub const TRANSITIONS: usize = 4;

/// What became of a leader's error, as it says it at an event.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Past {
    /// Φ from the last event to this one, from the last but one, and so on.
    pub transitions: [[[f64; 3]; 3]; TRANSITIONS],
    /// So many of them are known; others are nothing. After a start, or after somebody set the pose, none is.
    pub known: u8,
}

impl Past {
    /// Φ from so many events ago, at least one.
    fn from(&self, events: usize) -> Option<Matrix3<f64>> {
        let known = self.transitions.get(..usize::from(self.known));
        let known = known.unwrap_or(&self.transitions);
        let rows = known.get(events.checked_sub(1)?)?;
        Some(Matrix3::from(*rows).transpose()) // An array of rows is read as one of columns.
    }

    /// Whether all numbers are some.
    pub(super) fn is_near(&self, farthest: f64) -> bool {
        let mut all = self.transitions.as_flattened().as_flattened().iter();
        all.all(|it| it.abs() <= farthest)
    }
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
    /// How many events there were, as far as that counts.
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
        self.events = known.saturating_add(1).min(4);
        Past {
            transitions: self.before.map(|it| it.transpose().into()),
            known,
        }
    }
}

/// At a child: C of one leader.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Bond {
    cross: Matrix3<f64>,
    met: Met,
}

/// When C was what it is.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
enum Met {
    /// Nothing was ever heard of that leader: C is zero.
    #[default]
    Never,
    /// At this event.
    At(Slot),
    /// Nobody knows what became of the leader's error.
    Lost,
}

impl Bond {
    /// The child's own step, or a pose of another leader: F of its error.
    pub fn go_on(&mut self, by: &Matrix3<f64>) {
        self.cross = by * self.cross;
    }

    /// C at an event of which the leader says what became of its error; `None` if the chain is broken: then its poses can only be
    /// fused as dependent. A datum that is declined says it too.
    pub fn at_event(&mut self, slot: Slot, past: &Past) -> Option<&Matrix3<f64>> {
        let by = match self.met {
            Met::Never => Some(Matrix3::identity()),
            Met::At(last) if last == slot => Some(Matrix3::identity()),
            Met::At(last) => {
                let events = usize::try_from(slot.0.saturating_sub(last.0)).ok();
                events.and_then(|it| past.from(it))
            }
            Met::Lost => None,
        };
        self.met = by.map_or(Met::Lost, |_| Met::At(slot));
        self.cross = by.map_or(Matrix3::zeros(), |by| self.cross * by.transpose());
        by.map(|_| &self.cross)
    }

    /// What C became by a pose of that leader.
    pub fn set(&mut self, cross: Matrix3<f64>) {
        self.cross = cross;
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
        let steps = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(step);
        let mut last = Past::default();
        for (number, it) in (0..).zip(&steps) {
            leader.go_on(it);
            last = leader.at_event();
            assert_eq!(last.known, number.min(4));
        }
        let mut product = Matrix3::identity();
        for (events, it) in steps.iter().rev().take(TRANSITIONS).enumerate() {
            product *= it;
            let said = last.from(events + 1).unwrap();
            assert!((said - product).abs().max() < 1e-12, "{events}");
        }
    }

    #[test]
    fn a_child_may_miss_three_events() {
        let mut leader = Transitions::default();
        let mut bond = Bond::default();
        let first = leader.at_event();
        assert_eq!(bond.at_event(Slot(1), &first), Some(&Matrix3::zeros()));
        bond.set(Matrix3::from_diagonal_element(0.01));
        let mut product = Matrix3::identity();
        let mut at = |slot: i64| {
            let by = step(0.1 * f64::from(i32::try_from(slot).unwrap()));
            leader.go_on(&by);
            product = by * product;
            (leader.at_event(), product)
        };
        let [_, _, _, (said, product)] = [2, 3, 4, 5].map(&mut at);
        let mut second = bond;
        let found = bond.at_event(Slot(5), &said).unwrap();
        assert!((found - product.transpose() * 0.01).abs().max() < 1e-15);
        let (said, _) = at(6);
        assert_eq!(second.at_event(Slot(6), &said), None, "it missed four");
        assert_eq!(second.at_event(Slot(7), &at(7).0), None, "for good");
        assert!(bond.at_event(Slot(6), &said).is_some());
        assert_eq!(bond.at_event(Slot(5), &said), None, "back in time");
    }

    #[test]
    fn a_leader_that_starts_anew_has_no_past() {
        let (mut leader, mut bond) = (Transitions::default(), Bond::default());
        assert!(bond.at_event(Slot(1), &leader.at_event()).is_some());
        assert!(bond.at_event(Slot(2), &leader.at_event()).is_some());
        leader.break_off();
        assert_eq!(bond.at_event(Slot(3), &leader.at_event()), None);
        let mut other = Bond::default();
        assert!(other.at_event(Slot(4), &leader.at_event()).is_some());
        let forged = Past {
            known: 200,
            ..leader.at_event()
        };
        assert!(other.at_event(Slot(5), &forged).is_some());
        assert_eq!(other.at_event(Slot(50), &forged), None);
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
