//! The nearest positive semidefinite matrix: negative eigenvalues set to zero.
//!
//! A dependent part that is the difference of two cubature results, or comes from outside, can be slightly indefinite; one
//! eigenvalue of −1e-11 was seen to drive the weight of split covariance intersection to its end. What is below zero
//! by rounding alone is left as it is.

use crate::symmetric::Symmetric3;

/// Jacobi converges quadratically: four sweeps do, the rest is margin.
const SWEEPS: usize = 10;

/// An eigenvalue below zero by no more than this part of the largest is rounding.
const ROUNDING: f64 = 1e-14;

/// `a` with its negative eigenvalues set to zero; `a` itself if it has none beyond rounding.
#[inline]
pub(crate) fn positive_part(a: &Symmetric3) -> Symmetric3 {
    if is_positive_definite(a) {
        *a
    } else {
        rebuilt(a)
    }
}

/// Gauss's pivots are all positive: cheap, and almost always so.
#[inline]
fn is_positive_definite(a: &Symmetric3) -> bool {
    let m2 = a.xx * a.yy - a.xy * a.xy;
    let m3 = a.pp * m2 - a.xp * (a.xp * a.yy - a.yp * a.xy) - a.yp * (a.xx * a.yp - a.xy * a.xp);
    a.xx > 0.0 && m2 > 0.0 && m3 > 0.0
}

/// `Σ max(λ, 0) v vᵀ` over the eigenpairs.
#[cold]
fn rebuilt(a: &Symmetric3) -> Symmetric3 {
    let (values, vectors) = eigen(a);
    let [least, largest] = [f64::min, f64::max].map(|of| values.into_iter().fold(0.0, of));
    if least >= -ROUNDING * largest {
        return *a;
    }
    let mut sum = Symmetric3::default();
    for (value, vector) in values.into_iter().zip(vectors) {
        sum = sum + Symmetric3::outer(value.max(0.0), vector);
    }
    sum
}

/// Eigenvalues and unit eigenvectors by cyclic Jacobi rotations.
fn eigen(a: &Symmetric3) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut m = a.rows();
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut m, &mut vectors, i, j);
        }
    }
    ([m[0][0], m[1][1], m[2][2]], vectors)
}

/// One rotation, in the plane of `i` and `j`, that makes `m[i][j]` zero (Golub and Van Loan, section 8.5).
fn rotate(m: &mut [[f64; 3]; 3], vectors: &mut [[f64; 3]; 3], i: usize, j: usize) {
    if m[i][j] == 0.0 {
        return;
    }
    let tau = (m[j][j] - m[i][i]) / (2.0 * m[i][j]);
    let t = libm::copysign(1.0, tau) / (libm::fabs(tau) + libm::hypot(1.0, tau));
    let c = 1.0 / libm::hypot(1.0, t);
    let s = t * c;
    for row in m.iter_mut() {
        (row[i], row[j]) = (c * row[i] - s * row[j], s * row[i] + c * row[j]);
    }
    for k in 0..3 {
        (m[i][k], m[j][k]) = (c * m[i][k] - s * m[j][k], s * m[i][k] + c * m[j][k]);
        (vectors[i][k], vectors[j][k]) = (
            c * vectors[i][k] - s * vectors[j][k],
            s * vectors[i][k] + c * vectors[j][k],
        );
    }
    (m[i][j], m[j][i]) = (0.0, 0.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    const BASIS: [[f64; 3]; 3] = [[0.6, 0.8, 0.0], [-0.48, 0.36, 0.8], [0.64, -0.48, 0.6]];

    fn composed(values: [f64; 3]) -> Symmetric3 {
        let parts = values
            .into_iter()
            .zip(BASIS)
            .map(|(value, vector)| Symmetric3::outer(value, vector));
        parts.fold(Symmetric3::default(), |sum, part| sum + part)
    }

    fn assert_close(a: &Symmetric3, b: &Symmetric3, tolerance: f64) {
        for (x, y) in a.rows().as_flattened().iter().zip(b.rows().as_flattened()) {
            assert!((x - y).abs() <= tolerance, "{a:?} is not {b:?}");
        }
    }

    #[test]
    fn a_positive_matrix_is_left_alone() {
        let a = composed([3.0, 1e-9, 2.0]);
        assert_eq!(positive_part(&a), a);
    }

    #[test]
    fn rounding_is_left_alone() {
        for values in [[3.0, 0.0, 2.0], [3.0, -1e-15, 2.0], [0.0, 0.0, 0.0]] {
            let a = composed(values);
            assert_eq!(positive_part(&a), a);
        }
    }

    #[test]
    fn negative_eigenvalues_become_zero() {
        assert_close(
            &positive_part(&composed([3.0, -1e-3, 2.0])),
            &composed([3.0, 0.0, 2.0]),
            1e-14,
        );
        assert_close(
            &positive_part(&composed([-1.0, -1e-3, 2e-4])),
            &composed([0.0, 0.0, 2e-4]),
            1e-15,
        );
        assert_close(
            &positive_part(&composed([-1.0, -2.0, -3.0])),
            &Symmetric3::default(),
            0.0,
        );
    }
}
