//! Estimate against truth: what every table and picture is made from.

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use coloc_shm_types::BeliefState;
use serde::Serialize;

/// One published estimate beside the truth at its stamp.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Comparison {
    /// World time of the estimate's stamp \[s\].
    pub(crate) time_s: f64,
    /// Where the robot was.
    pub(crate) truth: Pose,
    /// Where it said it was.
    pub(crate) estimate: Pose,
    /// Standard deviations it claimed: square roots of the diagonal of P \[m, m, rad\].
    pub(crate) sigma: [f64; 3],
}

impl Comparison {
    /// Estimate minus truth `[x, y, φ]`, the heading wrapped \[m, m, rad\].
    pub(crate) fn error(&self) -> [f64; 3] {
        [
            self.estimate.x - self.truth.x,
            self.estimate.y - self.truth.y,
            wrap(self.estimate.phi - self.truth.phi),
        ]
    }

    /// Three standard deviations \[m, m, rad\].
    pub(crate) fn three_sigma(&self) -> [f64; 3] {
        self.sigma.map(|sigma| 3.0 * sigma)
    }

    /// For each coordinate: is the error inside ±3σ?
    fn inside(&self) -> [bool; 3] {
        let (error, bound) = (self.error(), self.three_sigma());
        std::array::from_fn(|i| error[i].abs() <= bound[i])
    }
}

/// A comparison, and what the picture of a run wants beside it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Moment {
    pub(crate) comparison: Comparison,
    /// Covariance of the estimated place, `[xx, xy, yy]` \[m²\].
    pub(crate) covariance: [f64; 3],
    /// εᵀ P⁻¹ ε of the pose.
    pub(crate) nees: f64,
    /// Whether the robot says that it knows where it is.
    pub(crate) state: BeliefState,
    /// Where the robot's wheels alone would put it.
    pub(crate) by_wheels: Pose,
}

impl Moment {
    /// As if the wheels had been believed, with no word about how certain they are.
    pub(crate) fn of_wheels(&self) -> Comparison {
        Comparison {
            estimate: self.by_wheels,
            sigma: [f64::NAN; 3],
            ..self.comparison
        }
    }
}

/// εᵀ P⁻¹ ε, P row-major; not a number where P is no covariance.
pub(crate) fn nees([x, y, phi]: [f64; 3], p: &[f64; 9]) -> f64 {
    // ε through the Cholesky factor of P, from the top down.
    let a = p[0].sqrt();
    let (b, d) = (p[3] / a, p[6] / a);
    let c = (p[4] - b * b).sqrt();
    let e = (p[7] - b * d) / c;
    let f = (p[8] - d * d - e * e).sqrt();
    let u = x / a;
    let v = (y - b * u) / c;
    let w = (phi - d * u - e * v) / f;
    u * u + v * v + w * w
}

/// Averages over the ticks of a run, one value for each of x, y, φ.
#[derive(Copy, Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Accuracy {
    /// How many estimates it is made from.
    pub(crate) estimates: usize,
    /// Time mean of the absolute error \[m, m, rad\].
    pub(crate) mean_abs_error: [f64; 3],
    /// Root of the time mean of the squared error \[m, m, rad\].
    pub(crate) rms_error: [f64; 3],
    /// Share of the time inside ±3σ, 0 to 1.
    pub(crate) inside_3_sigma: [f64; 3],
}

impl Accuracy {
    /// `None` where there is nothing to average.
    #[allow(clippy::cast_precision_loss)] // Counts of ticks.
    pub(crate) fn of(comparisons: impl Iterator<Item = Comparison>) -> Option<Self> {
        let mut sums = Self::default();
        comparisons.for_each(|comparison| sums.add(&comparison));
        let n = sums.estimates as f64;
        let mean = |sum: [f64; 3]| sum.map(|sum| sum / n);
        (sums.estimates > 0).then(|| Self {
            estimates: sums.estimates,
            mean_abs_error: mean(sums.mean_abs_error),
            rms_error: mean(sums.rms_error).map(f64::sqrt),
            inside_3_sigma: mean(sums.inside_3_sigma),
        })
    }

    fn add(&mut self, comparison: &Comparison) {
        let (error, inside) = (comparison.error(), comparison.inside());
        self.estimates += 1;
        for i in 0..3 {
            self.mean_abs_error[i] += error[i].abs();
            self.rms_error[i] += error[i].powi(2);
            self.inside_3_sigma[i] += f64::from(u8::from(inside[i]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn comparison(x_error: f64, sigma: f64) -> Comparison {
        Comparison {
            time_s: 0.0,
            truth: Pose::new(1.0, 2.0, 3.1),
            estimate: Pose::new(1.0 + x_error, 2.0, -3.1),
            sigma: [sigma; 3],
        }
    }

    #[test]
    fn headings_are_compared_across_the_wrap() {
        let turn = 2.0 * std::f64::consts::PI - 6.2;
        assert!((comparison(0.0, 1.0).error()[2] - turn).abs() < 1e-12);
    }

    #[test]
    fn averages_are_over_time() {
        let comparisons = [
            comparison(0.3, 0.2),
            comparison(-0.1, 0.01),
            comparison(0.2, 0.1),
            comparison(0.0, 0.1),
        ];
        let accuracy = Accuracy::of(comparisons.into_iter()).unwrap();
        assert_eq!(accuracy.estimates, 4);
        assert!((accuracy.mean_abs_error[0] - 0.15).abs() < 1e-12);
        assert!((accuracy.rms_error[0] - 0.035_f64.sqrt()).abs() < 1e-12);
        assert!((accuracy.inside_3_sigma[0] - 0.75).abs() < 1e-12);
    }

    #[test]
    fn the_distance_of_an_error_is_by_the_inverse_of_its_covariance() {
        let p = [4.0, 1.0, 0.5, 1.0, 2.0, 0.3, 0.5, 0.3, 1.0];
        // P (1, 2, −1) = ε, so ε P⁻¹ ε = ε · (1, 2, −1).
        let error = [5.5, 4.7, 0.1];
        let expected = error[0] + 2.0 * error[1] - error[2];
        assert!((nees(error, &p) - expected).abs() < 1e-12);
        assert!(nees(error, &[-1.0; 9]).is_nan());
    }

    #[test]
    fn nothing_has_no_average() {
        assert_eq!(Accuracy::of(std::iter::empty()), None);
    }
}
