//! Where the robot really is: on a circle, without rest.

use coloc_tests::surroundings::TRACK_M;

/// Along the circle \[m/s\].
const SPEED_MPS: f64 = 3.0;
/// Of the heading \[rad/s\].
const TURN_RADPS: f64 = 0.3;

/// How far the left and the right wheel have come after `time_s` \[m\].
pub(crate) fn wheels_m(time_s: f64) -> [f64; 2] {
    let (way_m, lead_m) = (SPEED_MPS * time_s, TURN_RADPS * time_s * TRACK_M / 2.0);
    [way_m - lead_m, way_m + lead_m]
}

/// `[x, y, φ]` after `time_s`, from the origin along the x axis \[m, m, rad\].
pub(crate) fn pose(time_s: f64) -> [f64; 3] {
    let (angle, radius_m) = (TURN_RADPS * time_s, SPEED_MPS / TURN_RADPS);
    [
        radius_m * angle.sin(),
        radius_m * (1.0 - angle.cos()),
        wrapped(angle),
    ]
}

/// Into [−π, π].
pub(crate) fn wrapped(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}
