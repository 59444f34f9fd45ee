//! How many independent fixes the fixes of a receiver are worth.

use crate::drive::Drive;
use crate::robot::Robot;

/// Fixes of a receiver, and how many independent ones of the same variance would say as much of a place that does not move.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SampleSize {
    /// How many came.
    pub fixes: usize,
    /// What they are worth.
    pub effective: f64,
}

impl SampleSize {
    /// `(σ² + σ_s²) 1ᵀ C⁻¹ 1`, C being the covariance of the errors in one coordinate.
    #[must_use]
    pub fn of(drive: &Drive, robot: &Robot, receiver: usize) -> Self {
        let it = &robot.receivers[receiver];
        let (own, slow) = (it.sigma_m * it.sigma_m, it.slow_sigma_m * it.slow_sigma_m);
        let stamps = drive.fixes().iter().filter(|fix| fix.receiver == receiver);
        let (mut mean, mut variance, mut before_s) = (0.0, slow, None);
        let (mut fixes, mut worth) = (0, 0.0);
        for stamp_s in stamps.map(|fix| fix.stamp_s) {
            let dt_s = before_s.map_or(0.0, |before_s| stamp_s - before_s);
            before_s = Some(stamp_s);
            let kept = if it.slow_time_s > 0.0 {
                libm::exp(-dt_s / it.slow_time_s)
            } else {
                0.0
            };
            mean *= kept;
            variance = kept * kept * variance + slow * (1.0 - kept * kept);
            let (off, sum) = (1.0 - mean, variance + own);
            worth += off * off / sum;
            let gain = variance / sum;
            mean += gain * off;
            variance *= 1.0 - gain;
            fixes += 1;
        }
        Self {
            fixes,
            effective: (own + slow) * worth,
        }
    }
}
