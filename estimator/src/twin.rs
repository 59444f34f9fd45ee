//! Two numbers that undergo the same arithmetic: that of the total and that of the independent covariance.
//!
//! Nothing but pairs of plain operations, without a branch: the compiler makes one instruction of each pair.

use core::ops::{Add, Mul, Sub};

/// One number of the total covariance, one of the independent.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Twin {
    pub(crate) total: f64,
    pub(crate) independent: f64,
}

impl Twin {
    /// The same number twice.
    #[inline]
    pub(crate) fn both(a: f64) -> Self {
        Self {
            total: a,
            independent: a,
        }
    }

    #[inline]
    fn zip(self, b: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            total: f(self.total, b.total),
            independent: f(self.independent, b.independent),
        }
    }

    #[inline]
    pub(crate) fn sqrt(self) -> Self {
        Self {
            total: libm::sqrt(self.total),
            independent: libm::sqrt(self.independent),
        }
    }

    #[inline]
    pub(crate) fn reciprocal(self) -> Self {
        Self {
            total: 1.0 / self.total,
            independent: 1.0 / self.independent,
        }
    }

    /// The larger of each pair; `b` is a number.
    #[inline]
    pub(crate) fn larger(self, b: f64) -> Self {
        self.zip(Self::both(b), |a, b| if a <= b { b } else { a })
    }

    /// Itself where it exceeds `limit` or is no number, elsewhere `otherwise`.
    #[inline]
    pub(crate) fn above(self, limit: Self, otherwise: f64) -> Self {
        self.zip(limit, |a, limit| if a <= limit { otherwise } else { a })
    }

    /// Itself where `test`, which is not negative, is not zero; elsewhere zero.
    #[inline]
    pub(crate) fn unless_zero(self, test: Self) -> Self {
        self.zip(test, |a, test| if test <= 0.0 { 0.0 } else { a })
    }

    /// Whether both are below `limit`.
    #[inline]
    pub(crate) fn are_below(self, limit: f64) -> bool {
        self.total < limit && self.independent < limit
    }
}

impl Add for Twin {
    type Output = Self;
    #[inline]
    fn add(self, b: Self) -> Self {
        self.zip(b, |a, b| a + b)
    }
}

impl Sub for Twin {
    type Output = Self;
    #[inline]
    fn sub(self, b: Self) -> Self {
        self.zip(b, |a, b| a - b)
    }
}

impl Mul for Twin {
    type Output = Self;
    #[inline]
    fn mul(self, b: Self) -> Self {
        self.zip(b, |a, b| a * b)
    }
}

impl Add<Twin> for f64 {
    type Output = Twin;
    #[inline]
    fn add(self, b: Twin) -> Twin {
        Twin::both(self) + b
    }
}

impl Mul<Twin> for f64 {
    type Output = Twin;
    #[inline]
    fn mul(self, b: Twin) -> Twin {
        Twin::both(self) * b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAN: f64 = f64::NAN;

    fn twin(total: f64, independent: f64) -> Twin {
        Twin { total, independent }
    }

    #[test]
    fn each_is_compared_by_itself() {
        assert_eq!(twin(1.0, 3.0).larger(2.0), twin(2.0, 3.0));
        assert_eq!(twin(1.0, 3.0).above(twin(1.0, 2.0), 7.0), twin(7.0, 3.0));
        assert_eq!(twin(1.0, 3.0).unless_zero(twin(0.0, 1.0)), twin(0.0, 3.0));
        assert!(twin(1.0, 1.0).are_below(2.0));
        assert!(!twin(1.0, 2.0).are_below(2.0) && !twin(2.0, 1.0).are_below(2.0));
    }

    #[test]
    fn what_is_no_number_stays_none() {
        assert!(twin(NAN, 1.0).larger(2.0).total.is_nan());
        assert!(twin(NAN, 1.0).above(Twin::both(2.0), 0.0).total.is_nan());
        assert!(!twin(NAN, 1.0).are_below(2.0));
    }
}
