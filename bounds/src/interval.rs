//! Intervals of angles and of ranges.

use core::f64::consts::{PI, TAU};

/// The same angle in (−π, π].
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    let turned = libm::remainder(angle, TAU);
    if turned <= -PI { turned + TAU } else { turned }
}

/// An angle and how far off it can be. A half-width of π or more says nothing.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct AngleInterval {
    /// \[rad\]
    pub centre: f64,
    /// At least zero \[rad\].
    pub half: f64,
}

impl AngleInterval {
    /// Any angle.
    pub const UNKNOWN: Self = Self {
        centre: 0.0,
        half: PI,
    };

    /// `centre` ± `half`
    #[must_use]
    pub const fn new(centre: f64, half: f64) -> Self {
        Self { centre, half }
    }

    /// Finite, and of no negative width.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.centre.is_finite() && self.half.is_finite() && self.half >= 0.0
    }

    /// Whether nothing is known.
    #[must_use]
    pub fn is_unknown(&self) -> bool {
        self.half >= PI
    }

    /// Whether `angle` may be meant, give or take `slack`.
    #[must_use]
    pub fn contains(&self, angle: f64, slack: f64) -> bool {
        wrap(angle - self.centre).abs() <= self.half + slack
    }

    /// The sum of two angles of which each is known so well.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self::new(
            wrap(self.centre + other.centre),
            (self.half + other.half).min(PI),
        )
    }

    /// The difference of two angles of which each is known so well.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        self.plus(&Self::new(-other.centre, other.half))
    }

    /// What both allow; `None` if there is nothing, so that one of them lies.
    ///
    /// Where two arcs are left, the narrower of the inputs is the answer: it holds both.
    #[must_use]
    pub fn intersect(&self, other: &Self) -> Option<Self> {
        if self.half >= PI {
            return Some(*other);
        }
        if other.half >= PI {
            return Some(*self);
        }
        let apart = wrap(other.centre - self.centre);
        let reach = self.half + other.half;
        if apart.abs() > reach {
            return None;
        }
        if reach + apart.abs() >= TAU {
            return Some(if other.half < self.half {
                *other
            } else {
                *self
            });
        }
        let low = (-self.half).max(apart - other.half);
        let high = self.half.min(apart + other.half);
        Some(Self::new(
            wrap(self.centre + f64::midpoint(low, high)),
            (high - low) / 2.0,
        ))
    }

    /// After a turn at `rate` ± `rate_half` for `seconds`.
    #[must_use]
    pub fn turned(&self, rate: f64, rate_half: f64, seconds: f64) -> Self {
        Self::new(
            wrap(self.centre + seconds * rate),
            (self.half + seconds * rate_half).min(PI),
        )
    }

    /// Every heading during such a turn, not only at its ends.
    #[must_use]
    pub fn during(&self, rate: f64, rate_half: f64, seconds: f64) -> Self {
        Self::new(
            wrap(self.centre + seconds * rate / 2.0),
            (self.half + (rate.abs() + rate_half) * seconds / 2.0).min(PI),
        )
    }
}

/// The least and the largest range \[m\]; the largest may be infinite.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct RangeInterval {
    /// At least zero.
    pub least: f64,
    /// At least `least`.
    pub most: f64,
}

impl RangeInterval {
    /// A range of `metres` that is off by no more than `error` metres.
    #[must_use]
    pub fn additive(metres: f64, error: f64) -> Self {
        Self {
            least: (metres - error).max(0.0),
            most: metres + error,
        }
    }

    /// A range of `metres` that is off by no more than `part` of the true one, less than 1.
    #[must_use]
    pub fn multiplicative(metres: f64, part: f64) -> Self {
        Self {
            least: metres / (1.0 + part),
            most: metres / (1.0 - part),
        }
    }

    /// Not reversed, not negative, not NaN.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.least >= 0.0 && self.least.is_finite() && self.most >= self.least
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pi_is_pi_and_minus_pi_is_pi() {
        assert_eq!(wrap(PI), PI);
        assert_eq!(wrap(-PI), PI);
        assert!((wrap(7.0) - (7.0 - TAU)).abs() < 1e-15);
    }

    #[test]
    fn an_interval_holds_its_intersections() {
        for i in 0..400 {
            let number = f64::from(i);
            let a = AngleInterval::new(wrap(number * 0.37), 0.1 + (number * 0.61) % 3.0);
            let b = AngleInterval::new(wrap(number * 1.93), 0.1 + (number * 0.23) % 3.0);
            for step in 0..64 {
                let angle = f64::from(step) * TAU / 64.0;
                if a.contains(angle, 0.0) && b.contains(angle, 0.0) {
                    let both = a.intersect(&b).expect("an angle is in both");
                    assert!(both.contains(angle, 1e-12), "{a:?} {b:?} {angle}");
                }
            }
        }
    }

    #[test]
    fn a_reversed_range_and_a_nan_are_none() {
        for (least, most) in [(2.0, 1.0), (-1.0, 1.0), (f64::NAN, 1.0), (0.0, f64::NAN)] {
            assert!(!RangeInterval { least, most }.is_valid());
        }
        assert!(RangeInterval::additive(0.1, 0.3).is_valid());
        assert!(!AngleInterval::new(f64::NAN, 0.1).is_valid());
        assert!(!AngleInterval::new(0.0, -0.1).is_valid());
    }
}
