//! The weight of split covariance intersection: α ∈ [0, 1] that makes the result smallest \[32\].
//!
//! With `A = P_d + α P_i = α P₁`, `B = R_d + (1−α) R_i = (1−α) P₂` and `M = (1−α) A + α B`, the result is
//! `P⁺ = B M⁻¹ A`: finite at both ends. Its cost has the derivative `h − g`, convexity makes it increasing:
//!
//! ```text
//! g = tr W G P_d Gᵀ,  G = B M⁻¹ = (I−K)/α        W = I         for the trace
//! h = tr W H R_d Hᵀ,  H = A M⁻¹ = K/(1−α)        W = (P⁺)⁻¹    for the logarithm of the determinant
//! ```
//!
//! `√(h/g)` has its value 1 at the same α and is all but linear in α (for scalars it is a ratio of linear functions), so that few
//! evaluations find it. Seen from the other side, α and 1−α, P and R change places: the search only ever
//! looks at the half of the interval that begins at zero.

use crate::factor::Factor;
use crate::root::{BEFORE_THE_END, from_zero};
use crate::settings::Criterion;
use crate::split::Split;
use crate::symmetric::Symmetric3;

/// Of the weight.
const ACCURACY: f64 = 1e-9;

/// Pivots beyond this part of their diagonal entries lose no digits that matter to products of minors.
const REGULAR: f64 = 1e-6;

/// Determinants whose squares, times a variance of their scale, neither overflow nor vanish.
const HARMLESS: core::ops::Range<f64> = 1e-90..1e90;

/// α and 1 − α, both to full precision however small.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Weights {
    /// α, by which the own `P_d` is divided.
    pub(crate) own: f64,
    /// 1 − α, by which the received `R_d` is divided.
    pub(crate) received: f64,
}

impl Weights {
    /// `M = (1−α) P_d + α R_d + α (1−α) (P_i + R_i) = α (1−α) (P₁ + P₂)`: no cancellation, no division.
    #[inline]
    pub(crate) fn combine(self, own: &Split, received: &Split) -> Symmetric3 {
        own.dependent * self.received
            + received.dependent * self.own
            + (own.independent + received.independent) * (self.own * self.received)
    }
}

/// The optimal weights of two beliefs that both have a dependent part.
pub(crate) fn optimal(own: &Split, received: &Split, criterion: Criterion) -> Weights {
    let middle = excess(own, received, criterion, 0.5);
    if middle >= 0.0 {
        let small = smaller_weight(own, received, criterion, middle);
        return Weights {
            own: small,
            received: 1.0 - small,
        };
    }
    // With P and R in each other's place, √(h/g) is √(g/h).
    let small = smaller_weight(received, own, criterion, 1.0 / (1.0 + middle) - 1.0);
    Weights {
        own: 1.0 - small,
        received: small,
    }
}

/// The optimal weight of `near`, which is at most ½, where the excess is `middle`.
fn smaller_weight(near: &Split, far: &Split, criterion: Criterion, middle: f64) -> f64 {
    let excess = |weight| excess(near, far, criterion, weight);
    from_zero(excess, middle, lowest(near), ACCURACY)
}

/// Where the search for the weight of `near` begins: a regular part needs no look before the end.
fn lowest(near: &Split) -> &'static [f64] {
    if near.is_regular() {
        &[ACCURACY]
    } else {
        &[BEFORE_THE_END, ACCURACY]
    }
}

/// `√(h/g) − 1` at the given weight of `near`.
#[inline]
fn excess(near: &Split, far: &Split, criterion: Criterion, weight: f64) -> f64 {
    let weights = Weights {
        own: weight,
        received: 1.0 - weight,
    };
    let (a, b) = (near.bound(weights.own), far.bound(weights.received));
    let inverse = up_to_scale(&(a * weights.received + b * weights.own));
    let (big_g, big_h) = (b.times(&inverse), a.times(&inverse));
    let (g, h) = match criterion {
        Criterion::Trace => (
            big_g.congruence_trace(&near.dependent),
            big_h.congruence_trace(&far.dependent),
        ),
        Criterion::Determinant => (
            big_g.product_trace(&near.dependent.times(&Factor::new(&a).inverse())),
            big_h.product_trace(&far.dependent.times(&Factor::new(&b).inverse())),
        ),
    };
    // Two zeros: the weight does not matter. Rounding can leave either a little below.
    if g > 0.0 {
        libm::sqrt(h.max(0.0) / g) - 1.0
    } else {
        h.max(0.0)
    }
}

/// A multiple of `M⁻¹`, in `√(h/g)` as good as `M⁻¹` itself. Regular matrices need no division for it.
#[inline]
fn up_to_scale(m: &Symmetric3) -> Symmetric3 {
    let adjugate = m.adjugate();
    let determinant = m.xx * adjugate.xx + m.xy * adjugate.xy + m.xp * adjugate.xp;
    let is_regular =
        adjugate.pp > REGULAR * m.xx * m.yy && determinant > REGULAR * adjugate.pp * m.pp;
    if is_regular && HARMLESS.contains(&determinant) {
        adjugate
    } else {
        Factor::new(m).inverse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance3;

    fn symmetric(rows: [f64; 9]) -> Symmetric3 {
        Covariance3::from_row_major(rows).unwrap().symmetric()
    }

    #[test]
    fn a_regular_matrix_takes_no_division() {
        let m = symmetric([4.0, 1.0, -0.2, 1.0, 9.0, 0.3, -0.2, 0.3, 0.1]);
        assert_eq!(up_to_scale(&m), m.adjugate());
        let small = symmetric([4e-9, 0.0, 0.0, 0.0, 9e-6, 0.0, 0.0, 0.0, 1e-3]);
        assert_eq!(up_to_scale(&small), small.adjugate());
    }

    /// Where it would cancel, or leave what a number can hold.
    #[test]
    fn any_other_matrix_is_factored() {
        let near = 1.0 - 1e-9;
        for m in [
            symmetric([1.0, near, 0.0, near, 1.0, 0.0, 0.0, 0.0, 1.0]),
            symmetric([1.0, 0.0, near, 0.0, 1.0, 0.0, near, 0.0, 1.0]),
            symmetric([1.0, 0.0, 0.0, 0.0, 1.0, near, 0.0, near, 1.0]),
            symmetric([1e-31, 0.0, 0.0, 0.0, 1e-31, 0.0, 0.0, 0.0, 1e-31]),
            symmetric([1e31, 0.0, 0.0, 0.0, 1e31, 0.0, 0.0, 0.0, 1e31]),
        ] {
            assert_eq!(up_to_scale(&m), Factor::new(&m).inverse());
        }
    }
}
