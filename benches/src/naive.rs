//! The same equations as a user would first write them: dynamically sized matrices, one generic cubature
//! transform, a golden-section search. Correct for regular matrices, and what an optimisation has to beat.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

/// Mean and covariance of the images of the `2n` cubature points of N(`mean`, `covariance`) \[6, 7\].
///
/// # Panics
/// If `covariance` is not positive definite: the first version of a filter would stop there.
#[must_use]
pub fn cubature(
    mean: &DVector<f64>,
    covariance: &DMatrix<f64>,
    image: impl Fn(&DVector<f64>) -> DVector<f64>,
) -> (DVector<f64>, DMatrix<f64>) {
    let n = mean.len();
    #[allow(clippy::expect_used)] // Stated in the documentation.
    let factor = covariance
        .clone()
        .cholesky()
        .expect("positive definite")
        .l();
    #[allow(clippy::cast_precision_loss)]
    let scale = (n as f64).sqrt();
    let mut images = Vec::new();
    for j in 0..n {
        let offset = factor.column(j) * scale;
        images.push(image(&(mean + &offset)));
        images.push(image(&(mean - &offset)));
    }
    #[allow(clippy::cast_precision_loss)]
    let weight = 1.0 / images.len() as f64;
    let centre = images
        .iter()
        .fold(DVector::zeros(images[0].len()), |sum, x| sum + x)
        * weight;
    let spread = images
        .iter()
        .map(|x| (x - &centre) * (x - &centre).transpose())
        .fold(DMatrix::zeros(centre.len(), centre.len()), |sum, square| {
            sum + square
        });
    (centre, spread * weight)
}

fn block_diagonal(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let n = a.nrows() + b.nrows();
    let mut joined = DMatrix::zeros(n, n);
    joined.view_mut((0, 0), a.shape()).copy_from(a);
    joined.view_mut(a.shape(), b.shape()).copy_from(b);
    joined
}

fn stacked(a: &DVector<f64>, b: &DVector<f64>) -> DVector<f64> {
    DVector::from_iterator(a.len() + b.len(), a.iter().chain(b.iter()).copied())
}

/// Algorithm 1 for a robot without sideways velocity: the pose after `dt_s`, total and independent covariance.
#[must_use]
pub fn propagate(
    pose: &DVector<f64>,
    total: &DMatrix<f64>,
    independent: &DMatrix<f64>,
    velocity: &DVector<f64>,
    noise: &DMatrix<f64>,
    dt_s: f64,
) -> (DVector<f64>, DMatrix<f64>, DMatrix<f64>) {
    let motion = |s: &DVector<f64>| {
        DVector::from_vec(vec![
            s[0] + dt_s * s[3] * s[2].cos(),
            s[1] + dt_s * s[3] * s[2].sin(),
            s[2] + dt_s * s[4],
        ])
    };
    let state = stacked(pose, velocity);
    let (mut mean, total) = cubature(&state, &block_diagonal(total, noise), motion);
    let (_, independent) = cubature(&state, &block_diagonal(independent, noise), motion);
    mean[2] = wrap(mean[2]);
    (mean, total, independent)
}

/// Algorithm 2: y*, R* and `R*_i` of a `relative` pose seen from `pose`.
#[must_use]
pub fn convert(
    pose: &DVector<f64>,
    total: &DMatrix<f64>,
    independent: &DMatrix<f64>,
    relative: &DVector<f64>,
    noise: &DMatrix<f64>,
) -> (DVector<f64>, DMatrix<f64>, DMatrix<f64>) {
    let compose = |s: &DVector<f64>| {
        let (sine, cosine) = s[2].sin_cos();
        DVector::from_vec(vec![
            s[0] + cosine * s[3] - sine * s[4],
            s[1] + sine * s[3] + cosine * s[4],
            s[2] + s[5],
        ])
    };
    let state = stacked(pose, relative);
    let (mut mean, total) = cubature(&state, &block_diagonal(total, noise), compose);
    let (_, independent) = cubature(&state, &block_diagonal(independent, noise), compose);
    mean[2] = wrap(mean[2]);
    (mean, total, independent)
}

/// What [`split_ci`] fuses: a mean with total and independent covariance.
#[derive(Clone, Debug)]
pub struct Split {
    /// Pose.
    pub mean: DVector<f64>,
    /// P
    pub total: DMatrix<f64>,
    /// `P_i`
    pub independent: DMatrix<f64>,
}

/// Algorithm 3 with the trace criterion, gate included; `None` if the gate refuses.
#[must_use]
pub fn split_ci(own: &Split, received: &Split, gate: f64) -> Option<Split> {
    let alpha = golden_section(|alpha| {
        bounds(own, received, alpha).and_then(|(p1, p2)| Some(gain(&p1, &p2)?.1.trace()))
    })?;
    let (p1, p2) = bounds(own, received, alpha)?;
    let (k, total) = gain(&p1, &p2)?;
    let mut innovation = &received.mean - &own.mean;
    innovation[2] = wrap(innovation[2]);
    let d2 = (innovation.transpose() * (&p1 + &p2).try_inverse()? * &innovation)[(0, 0)];
    if d2 > gate {
        return None;
    }
    let keep = DMatrix::identity(3, 3) - &k;
    let mut mean = &own.mean + &k * innovation;
    mean[2] = wrap(mean[2]);
    let independent =
        &keep * &own.independent * keep.transpose() + &k * &received.independent * k.transpose();
    Some(Split {
        mean,
        total,
        independent,
    })
}

fn bounds(own: &Split, received: &Split, alpha: f64) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let p1 = (&own.total - &own.independent) / alpha + &own.independent;
    let p2 = (&received.total - &received.independent) / (1.0 - alpha) + &received.independent;
    (p1.trace().is_finite() && p2.trace().is_finite()).then_some((p1, p2))
}

fn gain(p1: &DMatrix<f64>, p2: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let k = p1 * (p1 + p2).try_inverse()?;
    let total = (DMatrix::identity(3, 3) - &k) * p1;
    Some((k, total))
}

/// The α in (0, 1) with the smallest `cost`, to 1e-8.
fn golden_section(cost: impl Fn(f64) -> Option<f64>) -> Option<f64> {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (1e-9, 1.0 - 1e-9);
    while high - low > 1e-8 {
        let (left, right) = (high - RATIO * (high - low), low + RATIO * (high - low));
        if cost(left)? < cost(right)? {
            high = right;
        } else {
            low = left;
        }
    }
    Some(f64::midpoint(low, high))
}

/// The position fix \[38, 39\] in Joseph form; `None` if the gate refuses.
#[must_use]
pub fn fix(own: &Split, position: &DVector<f64>, noise: &DMatrix<f64>, gate: f64) -> Option<Split> {
    let h = DMatrix::from_row_slice(2, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let innovation = position - &h * &own.mean;
    let s = (&h * &own.total * h.transpose() + noise).try_inverse()?;
    if (innovation.transpose() * &s * &innovation)[(0, 0)] > gate {
        return None;
    }
    let k = &own.total * h.transpose() * s;
    let keep = DMatrix::identity(3, 3) - &k * &h;
    let joseph = |p: &DMatrix<f64>| &keep * p * keep.transpose() + &k * noise * k.transpose();
    let mut mean = &own.mean + &k * innovation;
    mean[2] = wrap(mean[2]);
    Some(Split {
        mean,
        total: joseph(&own.total),
        independent: joseph(&own.independent),
    })
}

fn wrap(a: f64) -> f64 {
    a - 2.0 * PI * ((a - PI) / (2.0 * PI)).ceil()
}
