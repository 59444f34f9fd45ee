//! Points in time and the spans between them: integers, never floats.

use core::ops::{Add, Sub};

/// A point in time: nanoseconds of the clock named in the configuration.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stamp(i64);

/// A signed length of time \[ns\].
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Span(i64);

impl Stamp {
    /// The stamp `nanos` nanoseconds after the clock's origin.
    #[must_use]
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the clock's origin.
    #[must_use]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }
}

impl Span {
    /// No time at all.
    pub const ZERO: Self = Self(0);

    /// A span of `nanos` nanoseconds.
    #[must_use]
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// A span of `millis` milliseconds.
    #[must_use]
    pub const fn from_millis(millis: i64) -> Self {
        Self(millis.saturating_mul(1_000_000))
    }

    /// The span of so many seconds, to the nanosecond; what does not fit is the longest.
    #[must_use]
    #[allow(clippy::cast_possible_truncation)] // It saturates, and makes zero of what is no number.
    pub fn from_seconds(seconds: f64) -> Self {
        Self(libm::rint(1e9 * seconds) as i64)
    }

    /// The span in nanoseconds.
    #[must_use]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// The span in seconds, correctly rounded.
    #[must_use]
    #[allow(clippy::cast_precision_loss)] // Spans within a history are far below 2^53 ns (104 days).
    pub fn as_seconds(self) -> f64 {
        self.0 as f64 / 1e9
    }
}

/// Saturates at the ends of the clock: a stamp comes from outside and may be anything.
impl Sub for Stamp {
    type Output = Span;
    fn sub(self, earlier: Self) -> Span {
        Span(self.0.saturating_sub(earlier.0))
    }
}

/// Saturates at the ends of the clock.
impl Add<Span> for Stamp {
    type Output = Self;
    fn add(self, span: Span) -> Self {
        Self(self.0.saturating_add(span.0))
    }
}

/// Saturates at the ends of the clock.
impl Sub<Span> for Stamp {
    type Output = Self;
    fn sub(self, span: Span) -> Self {
        Self(self.0.saturating_sub(span.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_is_exactly_its_seconds() {
        assert_eq!(
            Span::from_millis(20).as_seconds().to_bits(),
            0.02_f64.to_bits()
        );
    }

    #[test]
    fn the_ends_of_the_clock_saturate() {
        assert_eq!(
            Stamp::from_nanos(i64::MAX) - Stamp::from_nanos(i64::MIN),
            Span::from_nanos(i64::MAX)
        );
    }
}
