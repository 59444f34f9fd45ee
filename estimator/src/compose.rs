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
use crate::factor;
use crate::honest::Bend;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::rotate::rotated;
use crate::symmetric::Symmetric3;
use crate::turn::turns;
use crate::twin::Twin;

/// What is added to a pose, in its body frame.
pub(crate) struct Displacement {
    /// `[d_x, d_y, d_φ]` \[m, m, rad\].
    pub(crate) mean: [f64; 3],
    /// Covariance of its noise.
    pub(crate) noise: Symmetric3,
    /// n
    pub(crate) dimension: &'static Dimension,
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

/// `belief ⊕ displacement`: mean and total covariance from P, independent covariance from `P_i` in its place. The dependent
/// part is what is left, and may have lost its sign ([`Parts::with_its_sign`]); a Gaussian has no bend.
#[inline]
pub(crate) fn compose(belief: &Belief, displacement: &Displacement) -> Belief {
    let Displacement {
        mean: [dx, dy, turn],
        noise,
        dimension,
    } = displacement;
    let Pose { x, y, phi } = belief.pose;
    let (sin, cos) = libm::sincos(phi);
    let a = [cos * dx - sin * dy, sin * dx + cos * dy];
    let noise = rotated(noise, sin, cos);
    let Parts {
        independent,
        dependent,
    } = &belief.parts;
    let total = dependent.symmetric() + independent.symmetric();
    let Image { shortening, spread } = image(&total, &independent.symmetric(), a, dimension);
    let (ax, ay) = (a[0] - shortening * a[0], a[1] - shortening * a[1]);
    Belief {
        pose: Pose::new(x + ax, y + ay, phi + turn),
        parts: Parts {
            independent: Covariance3::trusted(&(spread.independent() + noise)),
            dependent: Covariance3::trusted(&(spread.total() - spread.independent())),
        },
        bend: Bend::ZERO,
    }
}

/// What becomes of the points on the pose's columns.
struct Image {
    /// k̄ of the total covariance.
    shortening: f64,
    /// Their covariances.
    spread: Spread,
}

/// Both covariances at once. It is not inlined so that its results meet side by side in memory: that is where the
/// compiler begins to make one instruction of two.
#[inline(never)]
fn image(total: &Symmetric3, independent: &Symmetric3, a: [f64; 2], n: &Dimension) -> Image {
    let root = Root::new(total, independent);
    let turns = Turns::new(&root.phi, n);
    Image {
        shortening: turns.mean.total,
        spread: root.spread(&turns, a),
    }
}

/// S, the lower Cholesky factor of the pose's covariance, row by row.
struct Root {
    x: Twin,
    y: [Twin; 2],
    phi: [Twin; 3],
}

/// What the columns' turns `h_j` do.
struct Turns {
    /// `sin h_j / √n`
    sines: [Twin; 3],
    /// k̄
    mean: Twin,
    /// `Σ (k_j − k̄)² / n` over all n columns (those of the noise have k = 0).
    variance: Twin,
}

/// A covariance, its lower triangle.
struct Spread([Twin; 6]);

impl Root {
    /// By minors, so that no division waits for another: with `m = xx·yy − xy²` and `c = xx·yp − xy·xp` the pivots are
    /// `xx`, `m/xx` and `pp − xp²/xx − c²/(xx·m)`. As in [`factor::Factor`], a pivot that is rounding has a zero column.
    #[inline]
    fn new(total: &Symmetric3, independent: &Symmetric3) -> Self {
        let entry = |entry: fn(&Symmetric3) -> f64| Twin {
            total: entry(total),
            independent: entry(independent),
        };
        let (xx, yy, pp) = (entry(|p| p.xx), entry(|p| p.yy), entry(|p| p.pp));
        let (xy, xp, yp) = (entry(|p| p.xy), entry(|p| p.xp), entry(|p| p.yp));

        let smallest = Twin::both(factor::ABSOLUTE);
        let d1 = xx.above(smallest, 0.0);
        // Without a first column, the minors of the rest.
        let (xx, xy, xp) = (
            xx.above(smallest, 1.0),
            xy.unless_zero(d1),
            xp.unless_zero(d1),
        );
        let m = xx * yy - xy * xy;
        let rounding = xx * rounding(yy);
        let (m, divisor) = (m.above(rounding, 0.0), xx * m.above(rounding, 1.0));
        let c = (xx * yp - xy * xp).unless_zero(m);
        let (r1, r2) = (xx.reciprocal(), divisor.reciprocal());
        let (l31, l32) = (xp * r1, c * r2); // Of the second column without its factor xx.
        let d3 = (pp - xp * l31 - c * l32).above(self::rounding(pp), 0.0);
        let (s1, s2, s3) = (d1.sqrt(), (m * r1).sqrt(), d3.sqrt());
        Self {
            x: s1,
            y: [xy * r1 * s1, s2],
            phi: [l31 * s1, l32 * xx * s2, s3],
        }
    }

    /// Covariance of the points on the pose's columns, with `b = ∂a/∂φ = [−a_y, a_x]`.
    #[inline]
    fn spread(&self, turns: &Turns, [ax, ay]: [f64; 2]) -> Spread {
        let [u, v, w] = turns.sines;
        let x = [self.x - ay * u, -ay * v, -ay * w];
        let y = [self.y[0] + ax * u, self.y[1] + ax * v, ax * w];
        let even = turns.variance;
        Spread([
            dot(x, x) + ax * ax * even,
            dot(x, y) + ax * ay * even,
            dot(x, self.phi),
            dot(y, y) + ay * ay * even,
            dot(y, self.phi),
            dot(self.phi, self.phi),
        ])
    }
}

/// Up to this a pivot counts as zero.
#[inline]
fn rounding(diagonal: Twin) -> Twin {
    (factor::RELATIVE * diagonal).larger(factor::ABSOLUTE)
}

impl Turns {
    /// From every column's `sin h_j` and `k_j ≥ 0`. `Σ (k_j − k̄)² = Σ k_j² − (Σ k_j)²/n` does not cancel: three of at
    /// least five terms are not zero, so that the second is at most 3/5 of the first.
    #[inline]
    fn new(phi: &[Twin; 3], n: &Dimension) -> Self {
        let [s1, s2, s3] = *phi;
        let [(u, k1), (v, k2), (w, k3)] = turns([n.root * s1, n.root * s2, n.root * s3]);
        let mean = n.reciprocal * (k1 + k2 + k3);
        let variance = n.reciprocal * (k1 * k1 + k2 * k2 + k3 * k3) - mean * mean;
        Self {
            sines: [
                n.reciprocal_root * u,
                n.reciprocal_root * v,
                n.reciprocal_root * w,
            ],
            mean,
            variance,
        }
    }
}

impl Spread {
    #[inline]
    fn total(&self) -> Symmetric3 {
        let [xx, xy, xp, yy, yp, pp] = &self.0;
        Symmetric3 {
            xx: xx.total,
            xy: xy.total,
            xp: xp.total,
            yy: yy.total,
            yp: yp.total,
            pp: pp.total,
        }
    }

    #[inline]
    fn independent(&self) -> Symmetric3 {
        let [xx, xy, xp, yy, yp, pp] = &self.0;
        Symmetric3 {
            xx: xx.independent,
            xy: xy.independent,
            xp: xp.independent,
            yy: yy.independent,
            yp: yp.independent,
            pp: pp.independent,
        }
    }
}

#[inline]
fn dot(a: [Twin; 3], b: [Twin; 3]) -> Twin {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
