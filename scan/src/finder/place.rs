//! Where a robot is looked for.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::reading::{Reading, wrapped};
use super::turned::{OwnHeading, Swing};
use crate::shape::Look;

/// Where another robot is believed to be.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Prior {
    /// Its number.
    pub robot: u16,
    /// Place of its look.
    pub look: usize,
    /// Forward, left and heading in the scanner's frame \[m, m, rad\].
    pub pose: [f64; 3],
    /// Of `pose`, 3×3 \[m², m·rad, rad²\].
    pub covariance: [[f64; 3]; 3],
}

/// By so much wider is looked for a robot that may have swung round.
const SWUNG: f64 = 3.0;

/// Where a robot is looked for.
#[derive(Copy, Clone, Debug)]
pub(super) struct Place {
    pub(super) prior: Prior,
    pub(super) mean: Vector3<f64>,
    pub(super) covariance: Matrix3<f64>,
    /// Of a body that may be half of itself off.
    near: Matrix2<f64>,
    /// With the own heading.
    pub(super) swing: Swing,
}

/// χ² of two and three numbers that one of a million exceeds: who is farther off cannot be meant, not even by mistake.
pub(super) const GATES: [f64; 2] = [27.631_021_115_928_547, 30.664_849_706_154_6];

impl Place {
    /// None of a prior that cannot be computed with.
    pub(super) fn of(prior: &Prior, looks: &[Look], own: &OwnHeading) -> Option<Self> {
        let reach = looks.get(prior.look)?.reach_m();
        let mean = Vector3::from(prior.pose);
        let covariance = Matrix3::from_fn(|row, column| prior.covariance[row][column]);
        let is_finite = mean
            .iter()
            .chain(covariance.iter())
            .all(|it| it.is_finite());
        let spread = Matrix2::identity() * (0.25 * reach * reach + 0.01);
        let near = covariance.fixed_view::<2, 2>(0, 0) + spread;
        let near = near.cholesky().filter(|_| is_finite)?.inverse();
        covariance
            .cholesky()
            .or_else(|| (covariance + Matrix3::identity() * 1e-12).cholesky())?;
        Some(Self {
            prior: *prior,
            mean,
            covariance,
            near,
            swing: Swing::of(own, &mean, &covariance),
        })
    }

    /// Whether the robot may be about there.
    pub(super) fn may_be(&self, point: Vector2<f64>) -> bool {
        let off = point - self.mean.xy();
        self.is_near(off)
    }

    /// Where everything may have swung round, what looks too far by the tangent may be on the circle; the readings will tell.
    fn is_near(&self, off: Vector2<f64>) -> bool {
        let wider = if self.swing.is_there() { SWUNG } else { 1.0 };
        (off.transpose() * self.near * off)[0] <= wider * GATES[0]
    }

    /// The same of a point that is up to `reach` from its middle.
    pub(super) fn may_be_within(&self, point: Vector2<f64>, reach: f64) -> bool {
        let off = point - self.mean.xy();
        let far = off.norm();
        // As if the mark were where the robot's middle may be that is nearest to the prior.
        let rest = off * ((far - reach).max(0.0) / far.max(1e-9));
        self.is_near(rest)
    }

    /// Mahalanobis distance, squared.
    pub(super) fn distance(&self, reading: &Reading) -> f64 {
        if self.swing.is_there() {
            return self.swing.distance(reading);
        }
        let sum = self.covariance + reading.covariance;
        let off = reading.pose - self.mean;
        if reading.has_heading {
            let off = Vector3::new(off.x, off.y, wrapped(off.z));
            let inverse = sum.try_inverse();
            return inverse.map_or(f64::INFINITY, |inverse| {
                (off.transpose() * inverse * off)[0]
            });
        }
        let sum: Matrix2<f64> = sum.fixed_view::<2, 2>(0, 0).into_owned();
        let off = off.xy();
        let inverse = sum.try_inverse();
        inverse.map_or(f64::INFINITY, |inverse| {
            (off.transpose() * inverse * off)[0]
        })
    }

    pub(super) fn likelihood(&self, reading: &Reading, distance: f64) -> f64 {
        let sum = self.covariance + reading.covariance;
        let spread = if reading.has_heading {
            TAU * TAU * TAU * sum.determinant()
        } else {
            let sum: Matrix2<f64> = sum.fixed_view::<2, 2>(0, 0).into_owned();
            TAU * TAU * sum.determinant()
        };
        (-0.5 * distance).exp() / spread.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOKS: [Look; 1] = [Look::Cylinder { radius_m: 0.2 }];

    fn prior(variance: f64) -> Prior {
        Prior {
            robot: 2,
            look: 0,
            pose: [2.0, 0.0, 3.1],
            covariance: [0, 1, 2]
                .map(|row| [0, 1, 2].map(|it| if it == row { variance } else { 0.0 })),
        }
    }

    #[test]
    fn a_prior_that_cannot_be_computed_with_is_no_place() {
        assert!(
            Place::of(&prior(0.04), &LOOKS, &OwnHeading::default()).is_some()
                && Place::of(&prior(0.0), &LOOKS, &OwnHeading::default()).is_some()
        );
        assert!(Place::of(&prior(f64::NAN), &LOOKS, &OwnHeading::default()).is_none());
        assert!(Place::of(&prior(-1.0), &LOOKS, &OwnHeading::default()).is_none());
        assert!(
            Place::of(
                &Prior {
                    look: 1,
                    ..prior(0.04)
                },
                &LOOKS,
                &OwnHeading::default(),
            )
            .is_none()
        );
    }

    #[test]
    fn a_robot_may_be_where_its_prior_allows() {
        let place = Place::of(&prior(0.04), &LOOKS, &OwnHeading::default()).unwrap();
        let far = Vector2::new(4.0, 0.0);
        assert!(place.may_be(Vector2::new(2.5, 0.0)) && !place.may_be(far));
        assert!(place.may_be_within(far, 1.5) && !place.may_be_within(far, 0.2));
    }

    #[test]
    fn a_heading_counts_the_short_way_round() {
        let place = Place::of(&prior(0.04), &LOOKS, &OwnHeading::default()).unwrap();
        let reading = Reading {
            candidate: 0,
            time_s: 0.0,
            pose: Vector3::new(2.0, 0.2, -3.1),
            covariance: Matrix3::zeros(),
            has_heading: true,
            is_clear: true,
        };
        let turned = TAU - 6.2;
        let expected = (0.04 + turned * turned) / 0.04;
        assert!((place.distance(&reading) - expected).abs() < 1e-9);
        assert!((place.distance(&reading.flat()) - 1.0).abs() < 1e-9);
    }
}
