//! The cubature transform of `x ⊕ d = x + Γ(φ) d`: a pose followed by a displacement in its body frame.
//!
//! Both Algorithm 1 (`d = δt ū`) and Algorithm 2 (`d = y`) are this transform, with the noise of `d` as the
//! second block of the augmented covariance. Its 2n points `± √n S e_j` never need to be formed. With
//! `a = Γ(φ̂) d`, `b = ∂a/∂φ` and column j of the pose's factor turning the heading by `h_j = √n S_φj`:
//!
//! * a ± pair shares one sine and cosine: it lands on `x̂ + cos h_j · a ± (√n S_j + sin h_j · b)`;
//! * the columns of the noise leave the heading alone: they land on `x̂ + a ± √n Γ(φ̂) S_j`, and their sum is
//!   `Γ Q Γᵀ` whatever the root, so it needs none;
//! * the mean is `x̂ + (1 − k̄) a` with `k_j = 1 − cos h_j` and `k̄ = Σ k_j / n`; the even parts of the deviations
//!   are multiples of `a`, the odd parts make a Gram matrix. No term is a difference of large ones: the result
//!   is centred, symmetric and positive semidefinite by construction.

use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::factor::Factor;
use crate::pose::Pose;
use crate::symmetric::Symmetric3;

/// What is added to a pose, in its body frame.
pub(crate) struct Displacement {
    /// `[d_x, d_y, d_φ]` \[m, m, rad\].
    pub(crate) mean: [f64; 3],
    /// Covariance of its noise.
    pub(crate) noise: Symmetric3,
    /// n: three for the pose and one for each independent noise, 5 or 6.
    pub(crate) dimension: f64,
}

/// `belief ⊕ displacement`: mean and total covariance from P, independent covariance from `P_i` in its place.
#[inline]
pub(crate) fn compose(belief: &Belief, displacement: &Displacement) -> Belief {
    let [dx, dy, turn] = displacement.mean;
    let Pose { x, y, phi } = belief.pose;
    let (sin, cos) = libm::sincos(phi);
    let lever = Lever {
        a: [cos * dx - sin * dy, sin * dx + cos * dy],
        dimension: displacement.dimension,
        root: libm::sqrt(displacement.dimension),
    };
    let noise = rotated(&displacement.noise, sin, cos);
    let (total, shortening) = lever.spread(&belief.total);
    let (independent, _) = lever.spread(&belief.independent);
    let [ax, ay] = lever.a.map(|a| (1.0 - shortening) * a);
    Belief {
        pose: Pose::new(x + ax, y + ay, phi + turn),
        total: Covariance3::trusted(&(total + noise)),
        independent: Covariance3::trusted(&(independent + noise)),
    }
}

/// The displacement in the common frame, at the mean heading.
struct Lever {
    /// a \[m\]
    a: [f64; 2],
    /// n
    dimension: f64,
    /// √n
    root: f64,
}

impl Lever {
    /// Covariance of the points on the pose's columns, and k̄.
    #[inline]
    fn spread(&self, covariance: &Covariance3) -> (Symmetric3, f64) {
        let factor = Factor::new(&covariance.symmetric());
        let [l21, l31, l32] = factor.lower;
        let [s1, s2, s3] = factor.scale();
        let heading = [l31 * s1, l32 * s2, s3]; // Row φ of S.
        let turns = heading.map(|s| libm::sincos(self.root * s));
        let [u, v, w] = turns.map(|(sin, _)| sin / self.root);
        let [ax, ay] = self.a;
        let (bx, by) = (-ay, ax);
        let row_x = [s1 + bx * u, bx * v, bx * w];
        let row_y = [l21 * s1 + by * u, s2 + by * v, by * w];
        let (even, mean) = self.even(turns.map(|(_, cos)| 1.0 - cos));
        let gram = Symmetric3 {
            xx: dot(row_x, row_x) + even * ax * ax,
            xy: dot(row_x, row_y) + even * ax * ay,
            xp: dot(row_x, heading),
            yy: dot(row_y, row_y) + even * ay * ay,
            yp: dot(row_y, heading),
            pp: dot(heading, heading),
        };
        (gram, mean)
    }

    /// `Σ (k_j − k̄)² / n` over all n columns (those of the noise have k = 0), and k̄.
    #[inline]
    fn even(&self, k: [f64; 3]) -> (f64, f64) {
        let mean = (k[0] + k[1] + k[2]) / self.dimension;
        let squares = k.map(|k| (k - mean) * (k - mean));
        let noise = (self.dimension - 3.0) * mean * mean;
        (
            (squares[0] + squares[1] + squares[2] + noise) / self.dimension,
            mean,
        )
    }
}

/// `Γ N Γᵀ`, column by column of `N = L D Lᵀ`, so that a singular N stays one to rounding.
#[inline]
fn rotated(noise: &Symmetric3, sin: f64, cos: f64) -> Symmetric3 {
    let factor = Factor::new(noise);
    let [l21, l31, l32] = factor.lower;
    let [d1, d2, d3] = factor.pivots;
    Symmetric3::outer(d1, [cos - sin * l21, sin + cos * l21, l31])
        + Symmetric3::outer(d2, [-sin, cos, l32])
        + Symmetric3::outer(d3, [0.0, 0.0, 1.0])
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
