//! What a body says of a robot's pose, if it is that robot.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::fit::Fit;

/// A pair, and what the robot's pose is if they belong together.
#[derive(Copy, Clone, Debug)]
pub(super) struct Reading {
    /// Place of the candidate that says so.
    pub(super) candidate: usize,
    /// Of which moment.
    pub(super) time_s: f64,
    pub(super) pose: Vector3<f64>,
    pub(super) covariance: Matrix3<f64>,
    pub(super) has_heading: bool,
    /// Whether it is the only one of its headings that can be meant.
    pub(super) is_clear: bool,
}

pub(super) fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

impl Fit {
    /// The pose of a robot whose body is so, turned by `turn`, and has its middle at `centre_m`.
    pub(super) fn reading(&self, turn: f64, centre_m: [f64; 2]) -> Reading {
        let centre = self.body.centre();
        let Some(heading) = self.heading else {
            return Reading {
                candidate: 0,
                time_s: 0.0,
                pose: Vector3::new(centre.x, centre.y, 0.0),
                covariance: self.covariance,
                has_heading: false,
                is_clear: true,
            };
        };
        let heading = wrapped(heading + turn);
        let (sin, cos) = heading.sin_cos();
        let [x, y] = centre_m;
        let arm = Vector2::new(cos * x - sin * y, sin * x + cos * y);
        let slope = Matrix3::new(1.0, 0.0, arm.y, 0.0, 1.0, -arm.x, 0.0, 0.0, 1.0);
        Reading {
            candidate: 0,
            time_s: 0.0,
            pose: Vector3::new(centre.x - arm.x, centre.y - arm.y, heading),
            covariance: slope * self.covariance * slope.transpose(),
            has_heading: true,
            is_clear: true,
        }
    }
}

impl Reading {
    /// The same without its heading.
    pub(super) fn flat(&self) -> Self {
        Self {
            has_heading: false,
            ..*self
        }
    }

    pub(super) fn told_pose(&self) -> [f64; 3] {
        let heading = if self.has_heading { self.pose.z } else { 0.0 };
        [self.pose.x, self.pose.y, heading]
    }

    pub(super) fn told_covariance(&self) -> [[f64; 3]; 3] {
        let covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        let is_told = |place: usize| place < 2 || self.has_heading;
        [0, 1, 2].map(|row| {
            [0, 1, 2].map(|column| {
                if is_told(row) && is_told(column) {
                    covariance[(row, column)]
                } else {
                    0.0
                }
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Body;

    fn fit(heading: Option<f64>) -> Fit {
        Fit {
            body: Body::Round {
                centre: Vector2::new(2.0, 1.0),
                radius: 0.3,
            },
            covariance: Matrix3::identity(),
            heading,
            chi2: 0.0,
            freedom: 1.0,
            lone: None,
        }
    }

    #[test]
    fn the_origin_is_where_the_middle_says_and_swings_with_the_heading() {
        let reading = fit(Some(0.0)).reading(std::f64::consts::FRAC_PI_2, [0.5, 0.0]);
        let off = reading.pose - Vector3::new(2.0, 0.5, std::f64::consts::FRAC_PI_2);
        assert!(off.norm() < 1e-12, "{reading:?}");
        // By half a metre for each radian, across the arm.
        assert!((reading.covariance[(0, 0)] - 1.25).abs() < 1e-12);
        assert!((reading.covariance[(1, 1)] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_heading_that_was_not_seen_is_not_told() {
        let told = fit(None).reading(1.0, [0.0; 2]);
        assert!(!told.has_heading);
        let whole = fit(Some(0.3)).reading(0.0, [0.0; 2]).flat();
        let [_, _, turn] = whole.told_covariance();
        assert!(whole.told_pose()[2] == 0.0 && turn.iter().all(|it| *it == 0.0));
    }

    #[test]
    fn angles_are_the_short_way_round() {
        assert!(
            (wrapped(TAU + 0.1) - 0.1).abs() < 1e-12 && (wrapped(6.0) - 6.0 + TAU).abs() < 1e-12
        );
    }
}
