//! Ellipsoidal gates: quantiles of the χ² distribution.

/// χ² with one degree of freedom, 99 %: headings.
pub const CHI2_1_99: f64 = 6.634_896_601_021_214;

/// χ² with two degrees of freedom, 99 %: position fixes.
pub const CHI2_2_99: f64 = 9.210_340_371_976_182;

/// χ² with three degrees of freedom, 99 %: neighbours' poses.
pub const CHI2_3_99: f64 = 11.344_866_730_144_373;

/// χ² with three degrees of freedom, 99.9 %.
pub const CHI2_3_999: f64 = 16.266_236_196_238_13;

/// Whether the normalised innovation squared `d2` is within `gate`; what is not a number never is.
pub(crate) fn accepts(d2: f64, gate: f64) -> bool {
    d2 <= gate
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With two degrees of freedom the quantile has a closed form: `−2 ln(1 − 0.99)`.
    #[test]
    fn the_quantile_is_that_of_99_percent() {
        assert!((CHI2_2_99 + 2.0 * libm::log(0.01)).abs() < 1e-14);
    }

    /// With one the distribution function is `erf √(x/2)`.
    #[test]
    fn the_quantile_of_one_is_that_of_99_percent() {
        assert!((libm::erf(libm::sqrt(CHI2_1_99 / 2.0)) - 0.99).abs() < 1e-14);
    }

    /// With three the distribution function is `erf √(x/2) − √(2x/π) e^(−x/2)`.
    #[test]
    fn the_quantile_of_three_is_that_of_99_percent() {
        let (x, pi) = (CHI2_3_99, core::f64::consts::PI);
        let p = libm::erf(libm::sqrt(x / 2.0)) - libm::sqrt(2.0 * x / pi) * libm::exp(-x / 2.0);
        assert!((p - 0.99).abs() < 1e-14);
    }

    #[test]
    fn the_gate_itself_is_inside_and_nothing_outside_is() {
        assert!(accepts(CHI2_2_99, CHI2_2_99) && accepts(1e300, f64::INFINITY));
        assert!(!accepts(CHI2_3_99, CHI2_2_99) && !accepts(f64::NAN, f64::INFINITY));
    }
}
