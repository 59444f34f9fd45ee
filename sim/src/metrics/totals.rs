//! Sums over time and runs, from which every figure of a report is made.

use super::CHI2_3_95;
use super::samples::Sample;

/// Sums over the steps of one or more runs.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Totals {
    count: f64,
    squares: [f64; 3],
    variances: [f64; 3],
    inside: [f64; 3],
    nees: f64,
    nees_outside: f64,
}

impl Totals {
    /// Adds a sample.
    pub fn add(&mut self, sample: &Sample) {
        self.count += 1.0;
        self.nees += sample.nees;
        // Counted this way, a NEES that is no number is outside.
        self.nees_outside += 1.0 - f64::from(u8::from(sample.nees <= CHI2_3_95));
        for i in 0..3 {
            let square = sample.error[i] * sample.error[i];
            self.squares[i] += square;
            self.variances[i] += sample.variance[i];
            self.inside[i] += f64::from(u8::from(square <= 9.0 * sample.variance[i]));
        }
    }

    /// Adds what another run summed up.
    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.nees += other.nees;
        self.nees_outside += other.nees_outside;
        for i in 0..3 {
            self.squares[i] += other.squares[i];
            self.variances[i] += other.variances[i];
            self.inside[i] += other.inside[i];
        }
    }

    /// Samples.
    #[must_use]
    pub fn count(&self) -> f64 {
        self.count
    }

    /// Root mean square error \[m, m, rad\].
    #[must_use]
    pub fn rms(&self) -> [f64; 3] {
        self.squares.map(|sum| (sum / self.count).sqrt())
    }

    /// Root mean square distance \[m\].
    #[must_use]
    pub fn rms_position(&self) -> f64 {
        ((self.squares[0] + self.squares[1]) / self.count).sqrt()
    }

    /// Mean NEES.
    #[must_use]
    pub fn nees(&self) -> f64 {
        self.nees / self.count
    }

    /// Share of samples whose NEES is outside its 95 % bound.
    #[must_use]
    pub fn nees_outside(&self) -> f64 {
        self.nees_outside / self.count
    }

    /// Share of samples within 3σ.
    #[must_use]
    pub fn inside_3_sigma(&self) -> [f64; 3] {
        self.inside.map(|count| count / self.count)
    }

    /// log₁₀ of mean variance over mean square error.
    #[must_use]
    pub fn credibility(&self) -> [f64; 3] {
        std::array::from_fn(|i| libm::log10(self.variances[i] / self.squares[i]))
    }
}

/// Sums over runs at one step.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct StepTotals {
    /// Runs.
    pub count: f64,
    /// Of e.
    pub errors: [f64; 3],
    /// Of e².
    pub squares: [f64; 3],
    /// Of the diagonal of P.
    pub variances: [f64; 3],
    /// Of NEES.
    pub nees: f64,
}

impl StepTotals {
    /// Adds a run's sample.
    pub fn add(&mut self, sample: &Sample) {
        self.count += 1.0;
        self.nees += sample.nees;
        for i in 0..3 {
            self.errors[i] += sample.error[i];
            self.squares[i] += sample.error[i] * sample.error[i];
            self.variances[i] += sample.variance[i];
        }
    }

    /// RMSE over runs \[m, m, rad\]; `None` if no run knew the truth.
    #[must_use]
    pub fn rmse(&self) -> Option<[f64; 3]> {
        (self.count > 0.0).then(|| self.squares.map(|sum| (sum / self.count).sqrt()))
    }
}

/// Sums over innovations of one sensor.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct NisTotals {
    /// Measurements that passed the gate.
    pub accepted: f64,
    /// Those that did not.
    pub gated: f64,
    d2: f64,
}

impl NisTotals {
    /// Adds an innovation.
    pub fn add(&mut self, accepted: bool, d2: f64) {
        if accepted {
            self.accepted += 1.0;
            self.d2 += d2;
        } else {
            self.gated += 1.0;
        }
    }

    /// Adds what another run summed up.
    pub fn merge(&mut self, other: &Self) {
        self.accepted += other.accepted;
        self.gated += other.gated;
        self.d2 += other.d2;
    }

    /// Mean NIS of those that passed the gate; `None` without any.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        (self.accepted > 0.0).then(|| self.d2 / self.accepted)
    }

    /// Share that did not pass.
    #[must_use]
    pub fn gated_share(&self) -> Option<f64> {
        let all = self.accepted + self.gated;
        (all > 0.0).then(|| self.gated / all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(error: f64, variance: f64) -> Sample {
        Sample {
            error: [error; 3],
            variance: [variance; 3],
            nees: 3.0 * error * error / variance,
        }
    }

    #[test]
    fn figures_of_two_samples() {
        let mut totals = Totals::default();
        totals.add(&sample(1.0, 1.0));
        let mut other = Totals::default();
        other.add(&sample(4.0, 1.0));
        totals.merge(&other);
        assert!((totals.rms()[0] - 8.5_f64.sqrt()).abs() < 1e-12);
        assert!((totals.rms_position() - 17.0_f64.sqrt()).abs() < 1e-12);
        assert!((totals.nees() - 25.5).abs() < 1e-12);
        assert_eq!(
            (totals.nees_outside(), totals.inside_3_sigma()),
            (0.5, [0.5; 3])
        );
        assert!(
            (totals.credibility()[2] - (1.0_f64 / 8.5).log10()).abs() < 1e-12,
            "overconfident is negative"
        );
    }

    #[test]
    fn a_nees_that_is_no_number_is_outside() {
        let mut totals = Totals::default();
        totals.add(&Sample {
            nees: f64::NAN,
            ..sample(1.0, 1.0)
        });
        assert!((totals.nees_outside() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn steps_without_truth_have_no_rmse() {
        assert_eq!(StepTotals::default().rmse(), None);
        let mut nis = NisTotals::default();
        nis.add(true, 2.0);
        nis.add(false, 50.0);
        assert_eq!((nis.mean(), nis.gated_share()), (Some(2.0), Some(0.5)));
    }
}
