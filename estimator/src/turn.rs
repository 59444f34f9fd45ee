//! Sine and versine, `1 − cos h`, of the angles by which the cubature points turn the heading.
//!
//! The points of a robot that knows its heading to 20° or better turn by less than π/4, where a polynomial does:
//! fdlibm's, as in `libm`, but for both covariances at once, and with the versine before 1 has swallowed its
//! last digits.

use crate::twin::Twin;

/// The polynomials hold to π/4: its square, rounded down.
const SMALL: f64 = 0.616;

/// `sin h` and `1 − cos h` of three angles \[rad\].
#[inline]
pub(crate) fn turns(h: [Twin; 3]) -> [(Twin, Twin); 3] {
    let [a, b, c] = h;
    if (a * a + b * b + c * c).are_below(SMALL) {
        // Written out, because the compiler does not look into the closures of `map` everywhere.
        [small(a), small(b), small(c)]
    } else {
        [large(a), large(b), large(c)]
    }
}

/// S. Moshier's coefficients in W. J. Cody's arrangement: `k_sin.c` and `k_cos.c` of fdlibm, error below 2⁻⁵⁸.
#[inline]
#[allow(clippy::excessive_precision, clippy::unreadable_literal)] // As published.
fn small(h: Twin) -> (Twin, Twin) {
    let z = h * h;
    let w = z * z;
    let sine = 8.33333333332248946124e-03
        + z * (-1.98412698298579493134e-04 + 2.75573137070700676789e-06 * z)
        + z * w * (-2.50507602534068634195e-08 + 1.58969099521155010221e-10 * z);
    let cosine = z
        * (4.16666666666666019037e-02
            + z * (-1.38888888888741095749e-03 + 2.48015872894767294178e-05 * z))
        + w * w
            * (-2.75573143513906633035e-07
                + z * (2.08757232129817482790e-09 + -1.13596475577881948265e-11 * z));
    (
        h + z * h * (-1.66666666666666324348e-01 + z * sine),
        0.5 * z - z * cosine,
    )
}

#[cold]
#[inline(never)]
fn large(h: Twin) -> (Twin, Twin) {
    let (total, independent) = (libm::sincos(h.total), libm::sincos(h.independent));
    let sine = Twin {
        total: total.0,
        independent: independent.0,
    };
    let versine = Twin {
        total: 1.0 - total.1,
        independent: 1.0 - independent.1,
    };
    (sine, versine)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine_and_versine(h: f64) -> (f64, f64) {
        let [_, _, (sine, versine)] = turns([Twin::both(0.0), Twin::both(0.0), Twin::both(h)]);
        assert_eq!(sine.total.to_bits(), sine.independent.to_bits());
        assert_eq!(versine.total.to_bits(), versine.independent.to_bits());
        (sine.total, versine.total)
    }

    #[test]
    fn every_angle_agrees_with_the_library() {
        for i in -4000..=4000 {
            let h = f64::from(i) * 1e-3;
            let (sine, versine) = sine_and_versine(h);
            let half = libm::sin(0.5 * h);
            assert!((sine - libm::sin(h)).abs() <= 2e-16 * h.abs(), "sin {h}");
            let exact = 2.0 * half * half;
            let rounding = if h.abs() < 0.78 { 1e-15 * exact } else { 1e-15 };
            assert!((versine - exact).abs() <= rounding, "1 - cos {h}");
        }
    }

    #[test]
    fn a_tiny_angle_keeps_its_digits() {
        assert_eq!(sine_and_versine(1e-9), (1e-9, 5e-19));
    }

    #[test]
    fn no_angle_is_none() {
        assert!(sine_and_versine(f64::NAN).0.is_nan());
    }
}
