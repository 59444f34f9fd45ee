//! What a pair of radios says too much, and a range without it.

use nalgebra::{Matrix2, Vector2};

/// `ρ = o + (1 + s) r`, with its covariance.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Calibration {
    /// s
    pub scale: f64,
    /// o \[m\]
    pub offset_m: f64,
    /// Of (s, o) \[1, m, m²\].
    pub covariance: Matrix2<f64>,
}

/// A range as it is published.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Corrected {
    /// \[m\]
    pub range_m: f64,
    /// Variance of what is new in every reading \[m²\].
    pub white: f64,
    /// Standard deviation of what the next reading has again, as a part of the range: `slow[0]` of a sighting.
    pub slow: f64,
}

impl Calibration {
    /// What a radio says of this range \[m\].
    #[must_use]
    pub fn said(&self, range_m: f64) -> f64 {
        self.offset_m + (1.0 + self.scale) * range_m
    }

    /// The range behind what a radio said, whose noise has this σ \[m, m\]; `None` where nothing is left of it.
    #[must_use]
    pub fn corrected(&self, said_m: f64, sigma_m: f64) -> Option<Corrected> {
        let stretch = 1.0 + self.scale;
        let range_m = (said_m - self.offset_m) / stretch;
        let slope = -Vector2::new(range_m, 1.0) / stretch;
        let variance = slope.dot(&(self.covariance * slope)).max(0.0);
        let sigma = sigma_m / stretch;
        (range_m > 0.0 && range_m.is_finite()).then(|| Corrected {
            range_m,
            white: sigma * sigma,
            slow: libm::sqrt(variance) / range_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAZA: Calibration = Calibration {
        scale: 0.07,
        offset_m: 0.3,
        covariance: Matrix2::new(1e-4, 0.0, 0.0, 0.04),
    };

    #[test]
    fn a_range_is_what_was_said_without_scale_and_offset() {
        let corrected = PLAZA.corrected(PLAZA.said(20.0), 0.5).expect("a range");
        assert!((corrected.range_m - 20.0).abs() < 1e-12);
        assert!((corrected.white - 0.25 / (1.07 * 1.07)).abs() < 1e-12);
        let slow_m = 20.0 * corrected.slow * 1.07;
        assert!((slow_m * slow_m - (0.04 + 0.04)).abs() < 1e-12, "{slow_m}");
    }

    #[test]
    fn where_less_was_said_than_the_offset_there_is_no_range() {
        assert_eq!(PLAZA.corrected(0.2, 0.5), None);
        assert_eq!(PLAZA.corrected(f64::NAN, 0.5), None);
    }
}
