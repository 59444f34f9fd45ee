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
    /// n
    pub(crate) dimension: Dimension,
}

/// n, the dimension of the augmented state: three for the pose and one for each noise.
pub(crate) struct Dimension {
    /// 1/n
    reciprocal: f64,
    /// √n
    root: f64,
    /// 1/√n
    reciprocal_root: f64,
}

impl Dimension {
    /// A pose and two noises.
    pub(crate) const FIVE: Self = Self {
        reciprocal: 0.2,
        root: 2.236_067_977_499_79,
        reciprocal_root: 0.447_213_595_499_957_9,
    };

    /// A pose and three noises.
    pub(crate) const SIX: Self = Self {
        reciprocal: 1.0 / 6.0,
        root: 2.449_489_742_783_178,
        reciprocal_root: 0.408_248_290_463_863,
    };
}

/// `belief ⊕ displacement`: mean and total covariance from P, independent covariance from `P_i` in its place.
///
/// What takes long (divisions, roots, sines) is begun for both covariances before either is finished.
#[inline]
pub(crate) fn compose(belief: &Belief, displacement: &Displacement) -> Belief {
    let (total, independent) = (Root::new(&belief.total), Root::new(&belief.independent));
    let Displacement {
        mean: [dx, dy, turn],
        noise,
        dimension,
    } = displacement;
    let Pose { x, y, phi } = belief.pose;
    let (sin, cos) = libm::sincos(phi);
    let a = [cos * dx - sin * dy, sin * dx + cos * dy];
    let noise = rotated(noise, sin, cos);
    let (turns, turns_independent) = (total.turns(dimension), independent.turns(dimension));
    let (ax, ay) = (a[0] - turns.mean * a[0], a[1] - turns.mean * a[1]);
    Belief {
        pose: Pose::new(x + ax, y + ay, phi + turn),
        total: Covariance3::trusted(&total.spread(&turns, a, &noise)),
        independent: Covariance3::trusted(&independent.spread(&turns_independent, a, &noise)),
    }
}

/// S, the lower Cholesky factor of the pose's covariance, row by row.
struct Root {
    x: f64,
    y: [f64; 2],
    phi: [f64; 3],
}

/// What the columns' turns `h_j` do.
struct Turns {
    /// `sin h_j / √n`
    sines: [f64; 3],
    /// k̄
    mean: f64,
    /// `Σ (k_j − k̄)² / n` over all n columns (those of the noise have k = 0).
    variance: f64,
}

impl Root {
    #[inline]
    fn new(covariance: &Covariance3) -> Self {
        let factor = Factor::new(&covariance.symmetric());
        let [l21, l31, l32] = factor.lower;
        let [s1, s2, s3] = factor.scale();
        Self {
            x: s1,
            y: [l21 * s1, s2],
            phi: [l31 * s1, l32 * s2, s3],
        }
    }

    #[inline]
    fn turns(&self, dimension: &Dimension) -> Turns {
        let turn = |s| {
            let (sin, cos) = libm::sincos(dimension.root * s);
            (sin * dimension.reciprocal_root, 1.0 - cos)
        };
        Turns::new(self.phi.map(turn), dimension)
    }

    /// Covariance of the points on the pose's columns, with `b = ∂a/∂φ = [−a_y, a_x]`, and of the noise.
    #[inline]
    fn spread(&self, turns: &Turns, [ax, ay]: [f64; 2], noise: &Symmetric3) -> Symmetric3 {
        let [u, v, w] = turns.sines;
        let x = [self.x - ay * u, -ay * v, -ay * w];
        let y = [self.y[0] + ax * u, self.y[1] + ax * v, ax * w];
        let even = turns.variance;
        Symmetric3 {
            xx: noise.xx + dot(x, x) + even * (ax * ax),
            xy: noise.xy + dot(x, y) + even * (ax * ay),
            xp: noise.xp + dot(x, self.phi),
            yy: noise.yy + dot(y, y) + even * (ay * ay),
            yp: noise.yp + dot(y, self.phi),
            pp: noise.pp + dot(self.phi, self.phi),
        }
    }
}

impl Turns {
    /// From every column's `sin h_j / √n` and `k_j ≥ 0`. `Σ (k_j − k̄)² = Σ k_j² − (Σ k_j)²/n` does not cancel: three
    /// of at least five terms are not zero, so that the second is at most 3/5 of the first.
    #[inline]
    fn new([(u, k1), (v, k2), (w, k3)]: [(f64, f64); 3], dimension: &Dimension) -> Self {
        let mean = (k1 + k2 + k3) * dimension.reciprocal;
        let variance = (k1 * k1 + k2 * k2 + k3 * k3) * dimension.reciprocal - mean * mean;
        Self {
            sines: [u, v, w],
            mean,
            variance,
        }
    }
}

/// `Γ N Γᵀ`, so that a singular N stays one to rounding.
#[inline]
fn rotated(noise: &Symmetric3, sin: f64, cos: f64) -> Symmetric3 {
    if noise.xy != 0.0 {
        return rotated_by_columns(noise, sin, cos);
    }
    Symmetric3 {
        xx: cos * cos * noise.xx + sin * sin * noise.yy,
        xy: cos * sin * (noise.xx - noise.yy),
        xp: cos * noise.xp - sin * noise.yp,
        yy: sin * sin * noise.xx + cos * cos * noise.yy,
        yp: sin * noise.xp + cos * noise.yp,
        pp: noise.pp,
    }
}

/// Column by column of `N = L D Lᵀ`: with x and y correlated, the direct sum would cancel where N is singular.
fn rotated_by_columns(noise: &Symmetric3, sin: f64, cos: f64) -> Symmetric3 {
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
