//! A heading: a Kalman update of one coordinate, after the exchange and before the fixes.

use super::{Key, Kind, Measured, Origin, SlowError, check_numbers, check_variances};
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// An absolute heading in the common frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct HeadingFix {
    /// When it was right.
    pub stamp: Stamp,
    /// Which sensor.
    pub origin: Origin,
    /// \[rad\]
    pub heading_rad: f64,
    /// \[rad²\]: of what is new in each word.
    pub variance: f64,
    /// Of what is not.
    pub slow: SlowError,
    /// What it is the heading of.
    pub of: HeadingOf,
}

/// What a heading is the heading of.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum HeadingOf {
    /// Where the body looks: a compass, two antennas.
    Body,
    /// Where an antenna moves: that tells where the body looks only while the wheels say that it moves.
    Course {
        /// Below this speed of the antenna it says nothing \[m/s\].
        least_m_s: f64,
        /// Where the antenna is in the body frame, forward and left \[m\]: it swings out in a turn.
        lever: [f64; 2],
    },
}

impl HeadingFix {
    /// Where the body looks if `velocity`, `[v, ω]` of a base that cannot move sideways, is that of its wheels \[rad\]; NaN says
    /// nothing.
    ///
    /// The antenna moves along `(v − ω l_y, ω l_x)` in the body frame: backwards, where the wheels do.
    #[inline]
    pub(crate) fn looking(&self, velocity: [f64; 2]) -> Option<f64> {
        let HeadingOf::Course { least_m_s, lever } = self.of else {
            return Some(self.heading_rad);
        };
        let ([v, omega], [forward, left]) = (velocity, lever);
        let (ahead, aside) = (v - omega * left, omega * forward);
        let is_fast = libm::hypot(ahead, aside) >= least_m_s;
        is_fast.then(|| self.heading_rad - libm::atan2(aside, ahead))
    }
}

impl Measured for HeadingFix {
    #[inline]
    fn key(&self) -> Key {
        Key::new(self.stamp, Kind::Heading, self.origin)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Heading, self.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_numbers(&[self.heading_rad, self.slow.variance])?;
        if let HeadingOf::Course { least_m_s, lever } = &self.of {
            check_numbers(&[*least_m_s])?;
            check_numbers(lever)?;
        }
        check_variances(&[self.variance])
    }

    fn with_floor(&self, floors: &Floors) -> Self {
        Self {
            variance: self.variance.max(floors.heading),
            ..*self
        }
    }

    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        let verdict = filter.turn(self, terms);
        if let Some(world) = world {
            world.report(self.source(), self.stamp, verdict);
        }
        Gauge::default()
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use super::*;
    use crate::angle::wrap;

    fn course(least_m_s: f64, lever: [f64; 2]) -> HeadingFix {
        HeadingFix {
            stamp: Stamp::default(),
            origin: Origin::counted(0),
            heading_rad: 0.5,
            variance: 0.01,
            slow: SlowError::default(),
            of: HeadingOf::Course { least_m_s, lever },
        }
    }

    fn looks(course: &HeadingFix, velocity: [f64; 2]) -> Option<f64> {
        course.looking(velocity).map(wrap)
    }

    #[test]
    fn a_course_is_a_heading_only_while_the_wheels_move_and_backwards_where_they_do() {
        let course = course(0.5, [0.0; 2]);
        assert_eq!(looks(&course, [0.4, 1.0]), None);
        assert_eq!(course.looking([f64::NAN; 2]), None, "it may move sideways");
        assert_eq!(looks(&course, [1.0, 1.0]), Some(0.5));
        let backward = looks(&course, [-1.0, 0.0]);
        assert!(backward.is_some_and(|it| (it - (0.5 - PI)).abs() < 1e-15));
    }

    /// A metre ahead of the axle, at 1 rad/s and 1 m/s, it moves 45° to the left of where the body looks.
    #[test]
    fn an_antenna_that_swings_out_in_a_turn_is_turned_back() {
        let ahead = looks(&course(0.5, [1.0, 0.0]), [1.0, 1.0]);
        assert!(ahead.is_some_and(|it| (it - (0.5 - PI / 4.0)).abs() < 1e-15));
        let left = looks(&course(0.5, [0.0, 1.0]), [1.0, 2.0]);
        assert!(left.is_some_and(|it| (it - (0.5 - PI)).abs() < 1e-15));
    }
}
