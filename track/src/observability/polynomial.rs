//! Polynomials in three variables, up to a degree: functions about a point, and their derivatives.

use core::ops::{Add, Mul};

/// Gradients of second derivatives, and one order more.
const DEGREE: usize = 4;

/// `c[i][j][k]` belongs to `x^i y^j z^k`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Polynomial([[[f64; DEGREE + 1]; DEGREE + 1]; DEGREE + 1]);

impl Polynomial {
    pub(super) fn constant(value: f64) -> Self {
        let mut all = Self([[[0.0; DEGREE + 1]; DEGREE + 1]; DEGREE + 1]);
        all.0[0][0][0] = value;
        all
    }

    /// Variable number `index`, about `value`.
    pub(super) fn variable(index: usize, value: f64) -> Self {
        let mut all = Self::constant(value);
        match index {
            0 => all.0[1][0][0] = 1.0,
            1 => all.0[0][1][0] = 1.0,
            _ => all.0[0][0][1] = 1.0,
        }
        all
    }

    /// At the point.
    pub(super) fn value(&self) -> f64 {
        self.0[0][0][0]
    }

    /// By variable number `index`.
    #[allow(clippy::cast_precision_loss)] // Powers up to DEGREE.
    pub(super) fn derivative(&self, index: usize) -> Self {
        let mut all = Self::constant(0.0);
        for (i, j, k) in powers().filter(|(i, j, k)| i + j + k < DEGREE) {
            let from = match index {
                0 => [i + 1, j, k],
                1 => [i, j + 1, k],
                _ => [i, j, k + 1],
            };
            let [a, b, c] = from;
            all.0[i][j][k] = from[index.min(2)] as f64 * self.0[a][b][c];
        }
        all
    }

    /// A function of it, given by its derivatives at the value.
    #[allow(clippy::cast_precision_loss)] // Orders up to DEGREE.
    fn through(&self, derivatives: [f64; DEGREE + 1]) -> Self {
        let mut rest = *self;
        rest.0[0][0][0] = 0.0;
        let (mut all, mut power) = (Self::constant(derivatives[0]), Self::constant(1.0));
        let mut factorial = 1.0;
        for (order, derivative) in derivatives.into_iter().enumerate().skip(1) {
            factorial *= order as f64;
            power = power * rest;
            all = all + power.scaled(derivative / factorial);
        }
        all
    }

    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self(self.0.map(|it| it.map(|it| it.map(|it| factor * it))))
    }

    pub(super) fn sine(&self) -> Self {
        let (sin, cos) = libm::sincos(self.value());
        self.through([sin, cos, -sin, -cos, sin])
    }

    pub(super) fn cosine(&self) -> Self {
        let (sin, cos) = libm::sincos(self.value());
        self.through([cos, -sin, -cos, sin, cos])
    }

    /// `a^p`
    pub(super) fn power(&self, p: f64) -> Self {
        let mut derivatives = [0.0; DEGREE + 1];
        let (mut factor, mut exponent) = (1.0, p);
        for it in &mut derivatives {
            *it = factor * libm::pow(self.value(), exponent);
            factor *= exponent;
            exponent -= 1.0;
        }
        self.through(derivatives)
    }
}

impl Add for Polynomial {
    type Output = Self;
    fn add(mut self, b: Self) -> Self {
        for (i, j, k) in powers() {
            self.0[i][j][k] += b.0[i][j][k];
        }
        self
    }
}

impl Mul for Polynomial {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        let mut all = Self::constant(0.0);
        for (i, j, k) in powers() {
            for (l, m, n) in powers().filter(|(l, m, n)| i + j + k + l + m + n <= DEGREE) {
                all.0[i + l][j + m][k + n] += self.0[i][j][k] * b.0[l][m][n];
            }
        }
        all
    }
}

/// All up to the degree.
fn powers() -> impl Iterator<Item = (usize, usize, usize)> {
    (0..=DEGREE).flat_map(|i| {
        (0..=DEGREE - i).flat_map(move |j| (0..=DEGREE - i - j).map(move |k| (i, j, k)))
    })
}
