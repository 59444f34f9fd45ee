//! Whether a claimed covariance is what the errors have.

use coloc_estimator::Covariance3;

/// 95 % quantile of χ² with two degrees of freedom.
const CHI2_2_95: f64 = 5.991_464_547_107_979;

/// By how much an honest mean may differ from 2.
const TOLERANCE: f64 = 0.25;

/// The share that may be outside of an ellipse for 95 %: a bent distribution has tails.
const MOST_OUTSIDE: f64 = 0.09;

/// Of the errors of many positions, normalised by what was claimed.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Score {
    count: f64,
    sum: f64,
    squares: f64,
    outside: f64,
}

impl Score {
    /// Adds eᵀ P⁻¹ e of one position.
    pub fn add(&mut self, nees: f64) {
        self.count += 1.0;
        self.sum += nees;
        self.squares += nees * nees;
        // Counted this way, one that is no number is outside.
        self.outside += 1.0 - f64::from(u8::from(nees <= CHI2_2_95));
    }

    /// Adds what others summed up.
    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.squares += other.squares;
        self.outside += other.outside;
    }

    /// Mean; nominal 2.
    #[must_use]
    pub fn nees(&self) -> f64 {
        self.sum / self.count
    }

    /// Share outside of the ellipse for 95 %; nominal 0.05.
    #[must_use]
    pub fn outside(&self) -> f64 {
        self.outside / self.count
    }

    /// Standard error of the mean, if all are independent of one another.
    #[must_use]
    pub fn standard_error(&self) -> f64 {
        let mean = self.nees();
        ((self.squares / self.count - mean * mean).max(0.0) / self.count).sqrt()
    }

    /// Mean within 2 ± 0.25, and between 0 and 9 % outside.
    #[must_use]
    pub fn is_honest(&self) -> bool {
        (self.nees() - 2.0).abs() <= TOLERANCE && self.outside() <= MOST_OUTSIDE
    }
}

/// eᵀ P⁻¹ e of a position's error; infinite where P says that there is none.
#[must_use]
pub(super) fn nees([x, y]: [f64; 2], p: &Covariance3) -> f64 {
    let [xx, xy, _, _, yy, ..] = p.to_row_major();
    let slope = xy / xx;
    let (rest, left) = (y - slope * x, yy - slope * xy);
    if xx > 0.0 && left > 0.0 {
        x * x / xx + rest * rest / left
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Noise, Purpose};

    fn covariance() -> Covariance3 {
        let entries = [4.0, 1.2, 0.0, 1.2, 1.0, 0.0, 0.0, 0.0, 1.0];
        Covariance3::from_row_major(entries).expect("positive")
    }

    #[test]
    fn squares_are_normalised() {
        // P⁻¹ = [1 −1.2; −1.2 4] / 2.56
        assert!((nees([2.0, 1.0], &covariance()) - 3.2 / 2.56).abs() < 1e-14);
        assert!((nees([0.0, 1.0], &covariance()) - 4.0 / 2.56).abs() < 1e-14);
        assert!(nees([0.0, 0.0], &Covariance3::ZERO).is_infinite());
    }

    /// N(0, P) by its Cholesky factor, claimed as it is, twice and half as large.
    #[test]
    fn who_claims_what_is_true_is_honest_and_nobody_else() {
        let noise = Noise::new(3, 0);
        let score = |factor: f64| {
            let claimed = covariance().scaled(factor);
            let mut score = Score::default();
            for robot in 0..4000 {
                let [a, b] = noise.draws(Purpose::TrueWay, 0, robot, 0).normals();
                score.add(nees([2.0 * a, 0.6 * a + 0.8 * b], &claimed));
            }
            score
        };
        let honest = score(1.0);
        assert!(honest.is_honest());
        assert!((honest.nees() - 2.0).abs() < 4.0 * honest.standard_error());
        assert!((honest.outside() - 0.05).abs() < 4.0 * (0.05 * 0.95 / 4000.0_f64).sqrt());
        assert!((honest.standard_error() - 2.0 / 4000.0_f64.sqrt()).abs() < 0.002);
        assert!(!score(0.5).is_honest() && !score(2.0).is_honest());
    }

    #[test]
    fn figures_of_three() {
        let (mut score, mut other) = (Score::default(), Score::default());
        score.add(1.0);
        score.add(2.0);
        other.add(6.0);
        score.merge(&other);
        assert!((score.nees() - 3.0).abs() < 1e-15 && (score.outside() - 1.0 / 3.0).abs() < 1e-15);
        other.add(f64::NAN);
        assert!((other.outside() - 1.0).abs() < 1e-15);
        assert!(!other.is_honest());
    }
}
