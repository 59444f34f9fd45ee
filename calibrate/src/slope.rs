//! How the likelihood changes with each parameter, and how much a drive says of them: scoring, after R. A. Fisher.
//!
//! With the innovations ν and their covariance `S = L Lᵀ`, `z = L⁻¹ ν` and `M_i = L⁻¹ ∂S/∂θ_i L⁻ᵀ`,
//!
//! ```text
//! ∂ log p/∂θ_i = Σ −(L⁻¹ ∂ν/∂θ_i)ᵀ z + ½ tr M_i (z zᵀ − I)
//! F_ij         = Σ  (L⁻¹ ∂ν/∂θ_i)ᵀ (L⁻¹ ∂ν/∂θ_j) + ½ tr M_i M_j
//! ```
//!
//! Both are sums over one list of five numbers for each innovation. F has no negative eigenvalue, and its inverse is the
//! Cramér–Rao bound of whoever has only this drive.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::filter::Innovation;
use crate::likelihood::Innovations;

/// Gradient and information.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Score {
    pub(crate) gradient: Vec<f64>,
    /// Row-major.
    pub(crate) information: Vec<f64>,
}

/// The inverse of the lower factor of a covariance, `[a, 0; b, c]`.
#[derive(Copy, Clone, Debug)]
struct Whitening {
    a: f64,
    b: f64,
    c: f64,
}

impl Whitening {
    fn of(it: &Innovation) -> Self {
        let [xx, xy, _, yy] = it.covariance;
        let first = xx.sqrt();
        let below = xy / first;
        let second = (yy - below * below).sqrt();
        Self {
            a: 1.0 / first,
            b: -below / (first * second),
            c: 1.0 / second,
        }
    }

    fn apply(self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.a * x, self.b * x + self.c * y]
    }

    /// `L⁻¹ S L⁻ᵀ` of a symmetric matrix: both variances, and what is between them.
    fn congruence(self, [xx, xy, _, yy]: [f64; 4]) -> [f64; 3] {
        let Self { a, b, c } = self;
        let between = a * (b * xx + c * xy);
        let second = b * b * xx + 2.0 * b * c * xy + c * c * yy;
        [a * a * xx, between, second]
    }
}

/// Of the parameters whose innovations a small `step` ahead are these.
pub(crate) fn score(at: &Innovations, ahead: &[Innovations], step: f64) -> Score {
    let whitening: Vec<Whitening> = at.0.iter().map(Whitening::of).collect();
    let slopes: Vec<Vec<[f64; 5]>> = ahead
        .iter()
        .map(|ahead| slopes([at, ahead], step, &whitening))
        .collect();
    let residuals: Vec<[f64; 5]> =
        at.0.iter()
            .zip(&whitening)
            .map(|(it, whitening)| {
                let [x, y] = whitening.apply(it.off);
                let half = |it: f64| (it * it - 1.0) * FRAC_1_SQRT_2;
                [-x, -y, half(x), x * y, half(y)]
            })
            .collect();
    let size = slopes.len();
    let mut information = vec![0.0; size * size];
    for row in 0..size {
        for column in 0..=row {
            let both = dot(&slopes[row], &slopes[column]);
            information[row * size + column] = both;
            information[column * size + row] = both;
        }
    }
    Score {
        gradient: slopes.iter().map(|it| dot(it, &residuals)).collect(),
        information,
    }
}

fn slopes([at, ahead]: [&Innovations; 2], step: f64, whitening: &[Whitening]) -> Vec<[f64; 5]> {
    let pairs = at.0.iter().zip(&ahead.0);
    let per = 1.0 / step;
    pairs
        .zip(whitening)
        .map(|((at, ahead), whitening)| {
            let off = [0, 1].map(|it| (ahead.off[it] - at.off[it]) * per);
            let grown = [0, 1, 2, 3].map(|it| (ahead.covariance[it] - at.covariance[it]) * per);
            let [x, y] = whitening.apply(off);
            let [xx, xy, yy] = whitening.congruence(grown);
            [x, y, xx * FRAC_1_SQRT_2, xy, yy * FRAC_1_SQRT_2]
        })
        .collect()
}

fn dot(one: &[[f64; 5]], other: &[[f64; 5]]) -> f64 {
    let products = one.iter().zip(other);
    products
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>())
        .sum()
}
