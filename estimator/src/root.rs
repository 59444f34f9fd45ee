//! The root of an increasing function in a bracket.

/// Bisection alone would need 30 evaluations for an accuracy of 1e-9; this bounds the worst case.
const EVALUATIONS: usize = 60;

/// A point and the function's value there.
type Point = (f64, f64);

/// The root between `low`, where the function is negative, and `high`, where it is positive, to `accuracy`.
///
/// T. R. Chandrupatla's method (Advances in Engineering Software 28, 1997): inverse quadratic interpolation where
/// the last three points allow it, bisection where not, begun by a secant.
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
        if let Some(root) = settled(last, third, other, accuracy) {
            return root;
        }
        step = interpolated(last, other, third).clamp(limit, 1.0 - limit);
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

/// The next secant's root, if it is nearer than the accuracy asked for: it errs by far less than its step.
fn settled(last: Point, third: Point, other: Point, accuracy: f64) -> Option<f64> {
    let step = last.1 * (third.0 - last.0) / (third.1 - last.1);
    let root = last.0 - step;
    let inside = (root - last.0) * (root - other.0) <= 0.0;
    (step.abs() < accuracy && inside && third.1.is_finite()).then_some(root)
}

/// Inverse quadratic interpolation, as a part of the way from `last` to `other`; the middle where it is not safe.
fn interpolated(last: Point, other: Point, third: Point) -> f64 {
    let ((x1, f1), (x2, f2), (x3, f3)) = (last, other, third);
    let xi = (x1 - x2) / (x3 - x2);
    let phi = (f1 - f2) / (f3 - f2);
    if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
        return f1 / (f2 - f1) * f3 / (f2 - f3)
            + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2);
    }
    0.5
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
    fn steps_and_poles_are_bracketed_all_the_same() {
        let (found, evaluations) = root_of(|x| if x < 0.3 { -1.0 } else { 1e12 });
        assert!((found - 0.3).abs() < 1e-9 && evaluations <= 60);
        let (found, _) = root_of(|x| if x < 0.5 { x - 0.1 } else { f64::INFINITY });
        assert!((found - 0.1).abs() < 1e-10);
    }
}
