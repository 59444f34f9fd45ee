//! What every estimate is held to.

use coloc_shm_types::Estimate;

use crate::way::wrapped;

/// What the noise of the wheels adds from one fix to the next at this speed is 0.27 m.
const LARGEST_SIGMA_M: f64 = 0.4;
const LARGEST_SIGMA_RAD: f64 = 0.2;
/// Nothing that the robot is told is wrong: what remains is the resolution of its encoders and the bend within a period.
const LARGEST_ERROR_M: f64 = 0.02;
const LARGEST_ERROR_RAD: f64 = 0.02;

/// Estimates so far, and the worst of them since the last look.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    /// All came, in order.
    pub(crate) estimates: u64,
    /// Distance to the truth \[m\].
    pub(crate) error_m: f64,
    /// Largest standard deviation of a coordinate \[m\].
    pub(crate) sigma_m: f64,
}

impl Watch {
    /// The next estimate, of a robot that is at `truth`.
    pub(crate) fn look(&mut self, estimate: &Estimate, truth: [f64; 3]) {
        assert_eq!(
            (estimate.header.sequence, estimate.tick),
            (self.estimates, self.estimates),
            "an estimate was lost"
        );
        self.estimates += 1;
        let [x, y, phi] = estimate.pose;
        let error_m = (x - truth[0]).hypot(y - truth[1]);
        let error_rad = wrapped(phi - truth[2]).abs();
        // Comparisons that hold are false for what is not a number.
        assert!(
            error_m < LARGEST_ERROR_M && error_rad < LARGEST_ERROR_RAD,
            "{error_m} m and {error_rad} rad off: {estimate:?}"
        );
        let total = estimate.total();
        let [sigma_x, sigma_y, sigma_phi] = sigmas(&total);
        let sigma_m = sigma_x.max(sigma_y);
        let independent = sigmas(&estimate.independent);
        assert!(
            is_covariance(&total)
                && sigma_m < LARGEST_SIGMA_M
                && sigma_phi < LARGEST_SIGMA_RAD
                && independent[0] <= sigma_x
                && independent[1] <= sigma_y
                && independent[2] <= sigma_phi,
            "{estimate:?}"
        );
        self.error_m = self.error_m.max(error_m);
        self.sigma_m = self.sigma_m.max(sigma_m);
    }

    /// Forgets what was worst.
    pub(crate) fn begin_again(&mut self) {
        (self.error_m, self.sigma_m) = (0.0, 0.0);
    }
}

fn sigmas(covariance: &[f64; 9]) -> [f64; 3] {
    [covariance[0], covariance[4], covariance[8]].map(f64::sqrt)
}

/// Finite, symmetric to the bit, positive definite by its leading minors.
#[allow(clippy::float_cmp, reason = "what is published was made symmetric")]
fn is_covariance(&[xx, xy, xp, yx, yy, yp, px, py, pp]: &[f64; 9]) -> bool {
    let minor = xx * yy - xy * yx;
    let determinant =
        xx * (yy * pp - yp * py) - xy * (yx * pp - yp * px) + xp * (yx * py - yy * px);
    [xy, xp, yp] == [yx, px, py] && xx > 0.0 && minor > 0.0 && determinant > 0.0
}
