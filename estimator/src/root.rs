//! The root of an increasing function in a bracket.

/// Bisection alone would need 30 evaluations for an accuracy of 1e-9; this bounds the worst case.
const EVALUATIONS: usize = 60;

/// Where to look for a change of sign before the very end, where derivatives are rounding noise for rank-deficient parts.
pub(crate) const BEFORE_THE_END: f64 = 1e-4;

/// A point and the function's value there.
type Point = (f64, f64);

/// The root in (0, ½], to `accuracy`, of a function that is positive at ½, where its value is `middle`; 0 if it is positive everywhere, which
/// is to say at the last of `lowest`, where a change of sign is looked for one after the other.
#[inline]
pub(crate) fn from_zero(f: impl Fn(f64) -> f64, middle: f64, lowest: &[f64], accuracy: f64) -> f64 {
    let mut high = (0.5, middle);
    for &x in lowest {
        let low = (x, f(x));
        if low.1 < 0.0 {
            return bracketed(f, low, high, accuracy);
        }
        high = low;
    }
    0.0
}

/// The root between `low`, where the function is negative, and `high`, where it is positive, to `accuracy`.
///
/// The hyperbola through the last three points gives the next one, where these lie so that T. R. Chandrupatla (Advances in
/// Engineering Software 28, 1997) would interpolate; where not, bisection. Begun by a chord, and done when chord and
/// hyperbola agree.
#[inline]
pub(crate) fn bracketed(f: impl Fn(f64) -> f64, low: Point, high: Point, accuracy: f64) -> f64 {
    let (mut last, mut other) = (low, high);
    let mut step = secant(last, other);
    for _ in 0..EVALUATIONS {
        let x = last.0 + step * (other.0 - last.0);
        let new = (x, f(x));
        let third = if (new.1 > 0.0) == (last.1 > 0.0) {
            last
        } else {
            core::mem::replace(&mut other, last)
        };
        last = new;
        let limit = accuracy / (other.0 - last.0).abs();
        if last.1 == 0.0 || limit > 0.5 {
            break;
        }
        let root = hyperbolic(last, other, third);
        if (root - chord(last, third)).abs() < accuracy && is_between(root, last, other) {
            return root;
        }
        step = part_of_the_way(root, last, other, third).clamp(limit, 1.0 - limit);
    }
    if last.1.abs() < other.1.abs() {
        last.0
    } else {
        other.0
    }
}

/// Where the chord from `a` to `b` crosses zero, as a part of the way.
fn secant(a: Point, b: Point) -> f64 {
    let step = a.1 / (a.1 - b.1);
    if step > 0.0 && step < 1.0 { step } else { 0.5 }
}

/// Where the chord through `a` and `b` is zero.
fn chord(a: Point, b: Point) -> f64 {
    a.0 - a.1 * (b.0 - a.0) / (b.1 - a.1)
}

/// Where the hyperbola `(x − r)/(p x + q)` through three points is zero (P. Jarratt and D. Nudds, The Computer
/// Journal 8, 1965).
fn hyperbolic(a: Point, b: Point, c: Point) -> f64 {
    let (b_way, c_way) = (b.0 - a.0, c.0 - a.0);
    let q = b_way * c_way * (c.1 - b.1) / (c.1 * c_way * (b.1 - a.1) - b.1 * b_way * (c.1 - a.1));
    a.0 - a.1 * q
}

fn is_between(x: f64, a: Point, b: Point) -> bool {
    (x - a.0) * (x - b.0) <= 0.0
}

/// `root` as a part of the way from `last` to `other`, where the three points lie so that it is to be trusted; else the
/// middle.
fn part_of_the_way(root: f64, last: Point, other: Point, third: Point) -> f64 {
    let ((x1, f1), (x2, f2), (x3, f3)) = (last, other, third);
    let xi = (x1 - x2) / (x3 - x2);
    let phi = (f1 - f2) / (f3 - f2);
    let is_safe = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi;
    if is_safe && is_between(root, last, other) {
        (root - x1) / (x2 - x1)
    } else {
        0.5
    }
}

#[cfg(test)]
mod tests {
    use core::cell::Cell;

    use super::*;

    fn root_of(f: impl Fn(f64) -> f64) -> (f64, u32) {
        let count = Cell::new(0);
        let counted = |x| {
            count.set(count.get() + 1);
            f(x)
        };
        (
            bracketed(counted, (0.0, f(0.0)), (0.5, f(0.5)), 1e-10),
            count.get(),
        )
    }

    #[test]
    fn smooth_functions_take_few_evaluations() {
        for (f, root) in [
            ((|x| x - 0.2) as fn(f64) -> f64, 0.2),
            (|x| x * x + x - 0.24, 0.2),
            (|x| libm::exp(5.0 * x) - 2.0, core::f64::consts::LN_2 / 5.0),
        ] {
            let (found, evaluations) = root_of(f);
            assert!((found - root).abs() < 1e-10, "{found} is not {root}");
            assert!(evaluations <= 8, "{evaluations} evaluations");
        }
    }

    #[test]
    fn a_chord_is_zero_where_it_crosses_the_axis() {
        assert_eq!(chord((1.0, 2.0), (5.0, -6.0)).to_bits(), 2.0_f64.to_bits());
        assert_eq!(chord((5.0, -6.0), (1.0, 2.0)).to_bits(), 2.0_f64.to_bits());
    }

    #[test]
    fn the_ends_lie_between_the_ends() {
        let (a, b) = ((1.0, 0.0), (3.0, 0.0));
        for (x, expected) in [
            (0.9, false),
            (1.0, true),
            (2.0, true),
            (3.0, true),
            (3.1, false),
        ] {
            assert_eq!(
                (is_between(x, a, b), is_between(x, b, a)),
                (expected, expected)
            );
        }
    }

    #[test]
    fn steps_and_poles_are_bracketed_all_the_same() {
        let (found, evaluations) = root_of(|x| if x < 0.3 { -1.0 } else { 1e12 });
        assert!((found - 0.3).abs() < 1e-9 && evaluations <= 60);
        let (found, _) = root_of(|x| if x < 0.5 { x - 0.1 } else { f64::INFINITY });
        assert!((found - 0.1).abs() < 1e-10);
    }
}
