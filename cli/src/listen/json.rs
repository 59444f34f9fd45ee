//! An object a line.

use coloc_shm_types::{Estimate, RobotName};
use serde::Serialize;

use super::reading::Reading;

#[derive(Serialize)]
struct Object<'a> {
    robot: &'a str,
    #[serde(flatten)]
    reading: Reading,
    covariance: [f64; 9],
    velocity_covariance: [f64; 9],
}

pub(super) fn line(robot: &RobotName, estimate: &Estimate) -> String {
    let object = Object {
        robot: robot.as_str(),
        reading: Reading::of(estimate),
        covariance: estimate.total(),
        velocity_covariance: estimate.velocity_covariance,
    };
    // Text and numbers alone: nothing in it can fail.
    serde_json::to_string(&object).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::super::reading::example;
    use super::*;

    fn parsed(estimate: &Estimate) -> Value {
        serde_json::from_str(&line(&RobotName::new("r1").unwrap(), estimate)).unwrap()
    }

    #[test]
    fn every_number_and_word_is_in_its_place() {
        let expected = json!({
            "robot": "r1", "session": "fedcba9876543210", "sequence": 7, "tick": 8, "clock": "realtime",
            "stamp_ns": 1_700_000_000_020_000_001_i64, "boot_ns": 5_000_000_000_i64,
            "x_m": 1.5, "y_m": -2.25, "heading_rad": 0.5,
            "sigma_x_m": 0.5, "sigma_y_m": 1.0, "sigma_heading_rad": 0.05,
            "vx_mps": 0.75, "vy_mps": 0.125, "omega_radps": -0.25,
            "state": "ok", "fit": false,
            "odometry_health": "ok", "relative_pose_health": "never_seen", "position_health": "stale",
            "neighbour_health": "never_seen", "pose_health": "never_seen",
            "odometry_x_m": 3.5, "odometry_y_m": 4.5, "odometry_heading_rad": -1.25,
            "unfit": "position 1.00 m > 0.88 m",
            "heading_health": "never_seen",
            "gyro_health": "never_seen", "gyro_bias_radps": 0.0625, "sigma_gyro_bias_radps": 0.03125,
            "opinion": "estimate_outside",
            "covariance": [0.25, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0025],
            "velocity_covariance": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9],
        });
        assert_eq!(parsed(&example()), expected);
    }

    #[test]
    fn what_is_no_number_is_null() {
        let estimate = Estimate {
            pose: [f64::NAN, f64::INFINITY, 0.0],
            independent: [-1.0; 9],
            ..example()
        };
        let object = parsed(&estimate);
        for name in ["x_m", "y_m", "sigma_x_m"] {
            assert!(object[name].is_null(), "{name}: {object}");
        }
    }
}
