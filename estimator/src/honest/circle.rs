//! The moments of `u = (cos φ, sin φ)`, φ Gaussian with variance s, along and across its mean.

/// Beyond these nothing is left of the mean direction, and s e² must not be ∞ · 0 \[rad²\].
const LARGEST_VARIANCE: f64 = 750.0;
const LARGEST_NOISE: f64 = 1500.0;

/// Below this `C_b − s e²` cancels \[rad²\].
const SERIES: f64 = 0.5;

/// What a heading's variance makes of a direction.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Circle {
    /// `e = exp(−s/2)`: the length of the mean direction.
    pub(crate) mean: f64,
    /// `Ω_a = ½ F²`, `F = 1 − e²`: the variance along.
    pub(crate) along: f64,
    /// `C_b = ½ F (2 − F)`: the variance across.
    pub(crate) sine: f64,
    /// `Ω_b = C_b − s e²`: of it, what is not linear in φ.
    pub(crate) across: f64,
}

impl Circle {
    /// Of the variance `s` \[rad²\].
    #[inline]
    pub(crate) fn of(s: f64) -> Self {
        if s < SERIES {
            return Self::of_small(s);
        }
        Self::of_large(s.min(LARGEST_VARIANCE))
    }

    /// `Ω_b = e² s³/6 (1 + s²/20 (1 + s²/42 (1 + s²/72 (1 + s²/110 (1 + s²/156)))))`
    #[inline]
    fn of_small(s: f64) -> Self {
        let fallen = libm::expm1(-0.5 * s);
        let (mean, z) = (1.0 + fallen, s * s);
        let series = 1.0 + z / 110.0 * (1.0 + z / 156.0);
        let series = 1.0 + z / 20.0 * (1.0 + z / 42.0 * (1.0 + z / 72.0 * series));
        let across = mean * mean * (s * z / 6.0) * series;
        Self::new(mean, -fallen * (2.0 + fallen), across)
    }

    #[cold]
    fn of_large(s: f64) -> Self {
        let mean = libm::exp(-0.5 * s);
        let loss = 1.0 - mean * mean;
        Self::new(mean, loss, 0.5 * loss * (2.0 - loss) - s * (mean * mean))
    }

    #[inline]
    fn new(mean: f64, loss: f64, across: f64) -> Self {
        Self {
            mean,
            along: 0.5 * loss * loss,
            sine: 0.5 * loss * (2.0 - loss),
            across,
        }
    }
}

/// `exp(−q/2)`: what the variance `q` \[rad²\] of a turn leaves of a direction.
#[inline]
pub(crate) fn kept(q: f64) -> f64 {
    libm::exp(-0.5 * q.min(LARGEST_NOISE))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both forms say the same where they meet, and what is smallest keeps its digits.
    #[test]
    fn no_digit_is_lost_from_one_form_to_the_other() {
        let (small, large) = (Circle::of_small(SERIES), Circle::of_large(SERIES));
        for (a, b) in [
            (small.mean, large.mean),
            (small.along, large.along),
            (small.sine, large.sine),
            (small.across, large.across),
        ] {
            assert!((a - b).abs() < 1e-14 * a, "{a} is not {b}");
        }
        let tiny = Circle::of(1e-12);
        assert!((tiny.sine / 1e-12 - 1.0).abs() < 1e-11);
        assert!((tiny.across / (1e-36 / 6.0) - 1.0).abs() < 1e-11);
        assert!((tiny.along / 5e-25 - 1.0).abs() < 1e-11);
    }

    #[test]
    fn whoever_knows_the_heading_exactly_or_not_at_all_is_no_special_case() {
        let certain = Circle::of(0.0);
        assert_eq!(
            (certain.mean, certain.sine, certain.across),
            (1.0, 0.0, 0.0)
        );
        for s in [800.0, 1e60, f64::INFINITY] {
            let lost = Circle::of(s);
            assert!(lost.mean < 1e-150 && lost.mean > 0.0);
            assert_eq!((lost.along, lost.sine, lost.across), (0.5, 0.5, 0.5));
            assert_eq!(kept(2.0 * s), kept(LARGEST_NOISE));
        }
        assert_eq!(kept(0.0), 1.0);
    }
}
