//! Paired comparison: the same runs with two methods, the noise of the runs cancelled.

use serde::Serialize;

use super::statistics::{mean_and_deviation, t_975};

/// Mean difference over runs, with its 95 % confidence interval (Student's t).
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct Paired {
    /// Mean of a − b.
    pub difference: f64,
    /// Half the width of the 95 % interval; infinite with a single run.
    pub half_width: f64,
    /// `difference` over the mean of b.
    pub relative: f64,
}

impl Paired {
    /// Compares `a` with `b`, run by run.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss)] // Runs are few.
    pub fn new(a: &[f64], b: &[f64]) -> Self {
        let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        let [difference, deviation] = mean_and_deviation(&differences);
        let [reference, _] = mean_and_deviation(b);
        let degrees = differences.len().saturating_sub(1) as u32;
        let half_width = if degrees == 0 {
            f64::INFINITY
        } else {
            t_975(degrees) * deviation / f64::from(degrees).sqrt()
        };
        Self {
            difference,
            half_width,
            relative: difference / reference,
        }
    }

    /// Whether the 95 % interval excludes zero.
    #[must_use]
    pub fn is_significant(&self) -> bool {
        self.difference.abs() > self.half_width
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_difference_is_significant_and_a_wavering_one_is_not() {
        let b = [10.0, 20.0, 30.0, 40.0];
        let steady = Paired::new(&b.map(|value| value - 1.0), &b);
        assert!(steady.is_significant() && (steady.difference + 1.0).abs() < 1e-12);
        assert!((steady.relative + 0.04).abs() < 1e-12);
        let wavering = Paired::new(&[11.0, 19.0, 31.5, 39.0], &b);
        assert!(!wavering.is_significant());
        assert!(
            !Paired::new(&[1.0], &[2.0]).is_significant(),
            "one run proves nothing"
        );
    }
}
