//! A robot's own way through one event, as it tells it: so a leader carries what holds at one moment to where that robot saw another.

use crate::angle::wrap;
use crate::covariance::Covariance3;
use crate::pose::Pose;

use super::datum::Reading;

/// In so many stretches of equal time; between their ends it is taken as straight.
pub const STRETCHES: usize = 8;

/// By the robot's own wheels.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Trail {
    /// Where each stretch ends, seen from where the event begins.
    pub ends: [Pose; STRETCHES],
    /// Of the last of them.
    pub noise: Covariance3,
}

impl Trail {
    /// From one part of the event to another, each from 0 to 1. Its noise is that of the whole way, by the share of the time: of a
    /// heading that errs it is more than that stretch's own.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> Reading {
        let [a, b] = [from, to].map(|part| self.at(part));
        let (sin, cos) = libm::sincos(a.phi);
        let (x, y) = (b.x - a.x, b.y - a.y);
        let share = libm::fabs(to - from);
        Reading {
            relative: Pose::new(cos * x + sin * y, cos * y - sin * x, b.phi - a.phi),
            covariance: self.noise.turned(-a.phi).scaled(share),
        }
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss
    )] // Eight.
    fn at(&self, part: f64) -> Pose {
        let stretches = part.clamp(0.0, 1.0) * STRETCHES as f64;
        let before = (stretches as usize).min(STRETCHES - 1);
        let end = |stretch: usize| self.ends.get(stretch).copied().unwrap_or_default();
        let a = before.checked_sub(1).map_or_else(Pose::default, end);
        let b = end(before);
        let share = stretches - before as f64;
        Pose {
            x: a.x + share * (b.x - a.x),
            y: a.y + share * (b.y - a.y),
            phi: a.phi + share * wrap(b.phi - a.phi),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight on at 0.8 m and a turn of 0.4 rad in the whole event.
    fn trail() -> Trail {
        let mut ends = [Pose::default(); STRETCHES];
        for (place, it) in (1_i32..).zip(&mut ends) {
            *it = Pose::new(0.1 * f64::from(place), 0.0, 0.05 * f64::from(place));
        }
        Trail {
            ends,
            noise: Covariance3::diagonal([0.04, 0.0, 0.01]).unwrap(),
        }
    }

    #[test]
    fn a_stretch_of_it_is_seen_from_where_it_begins() {
        let all = trail().between(0.0, 1.0);
        assert_eq!(all.relative, Pose::new(0.8, 0.0, 0.4));
        assert_eq!(all.covariance, trail().noise);
        let half = trail().between(0.5, 1.0);
        let (sin, cos) = libm::sincos(0.2);
        let expected = Pose::new(0.4 * cos, -0.4 * sin, 0.2);
        let off = half.relative.to_vector() - expected.to_vector();
        assert!(off.norm() < 1e-12, "{half:?}");
        let [x, y, phi] = half.covariance.variances();
        assert!((x + y - 0.02).abs() < 1e-12 && (phi - 0.005).abs() < 1e-12);
    }

    #[test]
    fn between_two_ends_it_is_straight_and_back_is_the_reverse() {
        let on = trail().between(0.0, 0.0625).relative;
        assert!((on.x - 0.05).abs() < 1e-12 && (on.phi - 0.025).abs() < 1e-12);
        let back = trail().between(0.0625, 0.0).relative;
        assert!((back.phi + 0.025).abs() < 1e-12 && back.x < 0.0);
        assert_eq!(trail().between(0.3, 0.3).covariance, Covariance3::ZERO);
    }
}
