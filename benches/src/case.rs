//! The numbers that every bench works on: a robot of the paper's team in mid-run.

use coloc_estimator::convert::GlobalPose;
use coloc_estimator::noise::OdometryNoise;
use coloc_estimator::{
    Belief, Bend, Covariance2, Covariance3, Motion, NotACovariance, Parts, Pose,
};

/// A regular belief: neither part is singular.
///
/// # Errors
/// None, unless a number of this file is changed for the worse.
pub fn belief() -> Result<Belief, NotACovariance> {
    let parts = Parts {
        independent: Covariance3::from_row_major([
            1e-3, 2e-4, 5e-5, 2e-4, 2e-3, -1e-4, 5e-5, -1e-4, 3e-4,
        ])?,
        dependent: Covariance3::from_row_major([
            3e-3, 4e-4, 1.5e-4, 4e-4, 7e-3, -2e-4, 1.5e-4, -2e-4, 7e-4,
        ])?,
    };
    let bend = Bend {
        along: [-2e-6, 1e-6, 0.0],
        across: [3e-7, 1e-6, 0.0],
    };
    Ok(Belief {
        pose: Pose::new(4.9, 1.2, -2.2),
        parts,
        bend,
    })
}

/// What a neighbour says about the robot of [`belief`]: `share` ∈ \[0, 1\] of it is independent.
///
/// # Errors
/// None, unless a number of this file is changed for the worse.
pub fn received(share: f64) -> Result<GlobalPose, NotACovariance> {
    let total =
        Covariance3::from_row_major([1.2e-2, -1e-3, 3e-4, -1e-3, 1.6e-2, 2e-4, 3e-4, 2e-4, 2e-3])?;
    Ok(GlobalPose {
        pose: Pose::new(4.95, 1.15, -2.18),
        parts: Parts {
            independent: total.scaled(share),
            dependent: total.scaled(1.0 - share),
        },
    })
}

/// A relative pose and its noise (Table 2).
///
/// # Errors
/// None, unless a number of this file is changed for the worse.
pub fn sighting() -> Result<(Pose, Covariance3), NotACovariance> {
    let sigma_rad = 1.0_f64.to_radians();
    Ok((
        Pose::new(-5.6, 3.9, -2.5),
        Covariance3::diagonal([0.01, 0.01, sigma_rad * sigma_rad])?,
    ))
}

/// A satellite fix and its noise (Table 2).
///
/// # Errors
/// None, unless a number of this file is changed for the worse.
pub fn fix() -> Result<([f64; 2], Covariance2), NotACovariance> {
    Ok(([4.93, 1.22], Covariance2::diagonal([0.01, 0.01])?))
}

/// A walking pace, with the noise of Table 2.
#[must_use]
pub fn motion() -> Motion {
    OdometryNoise::paper().nonholonomic([0.36, 0.2])
}
