//! The moments of `u = (cos φ, sin φ)`, φ Gaussian with variance s, along and across its mean.

/// Beyond these nothing is left of the mean direction, and s e² must not be ∞ · 0 \[rad²\].
const LARGEST_VARIANCE: f64 = 750.0;
const LARGEST_NOISE: f64 = 1500.0;

/// Below this `C_b − s e²` cancels \[rad²\].
const SERIES: f64 = 0.5;

/// Up to this the polynomial of [`fallen`] does: a heading known to 14°, and what a turn adds to it \[rad²\].
const SMALL: f64 = 0.0625;

/// Of `Ω_b = e² s³/6 (1 + s²/20 (1 + s²/42 (1 + s²/72 (1 + s²/110 (1 + s²/156)))))`.
const ACROSS: [f64; 6] = [
    1.0 / 6.0,
    1.0 / 120.0,
    1.0 / 5_040.0,
    1.0 / 362_880.0,
    1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
];

/// What a heading's variance makes of a direction, and what the noise of a turn leaves of it.
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
    /// `exp(−q/2)`
    pub(crate) kept: f64,
}

impl Circle {
    /// Of the heading's variance `s` and that of the turn's noise `q` \[rad²\].
    #[inline]
    pub(crate) fn of(s: f64, q: f64) -> Self {
        if s < SMALL && q < SMALL {
            let [by_variance, by_noise] = fallen([-0.5 * s, -0.5 * q]);
            return Self::of_small(s, by_variance, 1.0 + by_noise);
        }
        Self::of_any(s.min(LARGEST_VARIANCE), q.min(LARGEST_NOISE))
    }

    #[cold]
    #[inline(never)]
    fn of_any(s: f64, q: f64) -> Self {
        let kept = libm::exp(-0.5 * q);
        if s < SERIES {
            return Self::of_small(s, libm::expm1(-0.5 * s), kept);
        }
        let mean = libm::exp(-0.5 * s);
        let loss = 1.0 - mean * mean;
        let across = 0.5 * loss * (2.0 - loss) - s * (mean * mean);
        Self::new(mean, loss, across, kept)
    }

    /// `fallen` is `e − 1`.
    #[inline]
    fn of_small(s: f64, fallen: f64, kept: f64) -> Self {
        let (mean, z) = (1.0 + fallen, s * s);
        let [a, b, c, d, e, f] = ACROSS;
        let series = a + z * (b + z * (c + z * (d + z * (e + z * f))));
        let across = mean * mean * (s * z) * series;
        Self::new(mean, -fallen * (2.0 + fallen), across, kept)
    }

    #[inline]
    fn new(mean: f64, loss: f64, across: f64, kept: f64) -> Self {
        Self {
            mean,
            along: 0.5 * loss * loss,
            sine: 0.5 * loss * (2.0 - loss),
            across,
            kept,
        }
    }
}

/// `exp(x) − 1` of two numbers up to 1/32, to the last digit.
#[inline]
fn fallen(x: [f64; 2]) -> [f64; 2] {
    x.map(|x| {
        let rest = 1.0 / 720.0 + x * (1.0 / 5_040.0 + x * (1.0 / 40_320.0 + x / 362_880.0));
        let series = 1.0 / 6.0 + x * (1.0 / 24.0 + x * (1.0 / 120.0 + x * rest));
        x * (1.0 + x * (0.5 + x * series))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_close(a: &Circle, b: &Circle) {
        for (a, b) in [
            (a.mean, b.mean),
            (a.along, b.along),
            (a.sine, b.sine),
            (a.across, b.across),
            (a.kept, b.kept),
        ] {
            assert!((a - b).abs() < 1e-14 * a, "{a} is not {b}");
        }
    }

    /// All forms say the same where they meet.
    #[test]
    fn no_digit_is_lost_from_one_form_to_the_other() {
        let just_below = f64::from_bits(SMALL.to_bits() - 1);
        for variance in [just_below, 1e-3, 1e-12] {
            let polynomial = Circle::of(variance, variance);
            assert_close(&polynomial, &Circle::of_any(variance, variance));
        }
        let just_below = f64::from_bits(SERIES.to_bits() - 1);
        assert_close(
            &Circle::of_any(just_below, 0.0),
            &Circle::of_any(SERIES, 0.0),
        );
    }

    #[test]
    fn what_is_smallest_keeps_its_digits() {
        let tiny = Circle::of(1e-12, 1e-12);
        assert!((tiny.sine / 1e-12 - 1.0).abs() < 1e-11);
        assert!((tiny.across / (1e-36 / 6.0) - 1.0).abs() < 1e-11);
        assert!((tiny.along / 5e-25 - 1.0).abs() < 1e-11);
    }

    #[test]
    fn whoever_knows_the_heading_exactly_or_not_at_all_is_no_special_case() {
        let certain = Circle::of(0.0, 0.0);
        assert_eq!((certain.mean, certain.kept), (1.0, 1.0));
        assert_eq!((certain.sine, certain.across), (0.0, 0.0));
        for s in [800.0, 1e60, f64::INFINITY] {
            let lost = Circle::of(s, 2.0 * s);
            assert!(lost.mean < 1e-150 && lost.mean > 0.0 && lost.kept < 1e-300);
            assert_eq!((lost.along, lost.sine, lost.across), (0.5, 0.5, 0.5));
        }
    }
}
