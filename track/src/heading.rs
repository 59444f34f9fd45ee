//! From two free numbers to a heading, and back.

use coloc_estimator::angle::wrap;
use core::f64::consts::PI;
use nalgebra::{Matrix1, Matrix2, SMatrix, Vector1, Vector2};

use crate::plane::{J, unit};
use crate::state::{Core, Covariance, SIZE, State};
use crate::update::Linearised;

/// A direction shorter than this is none.
const NO_DIRECTION: f64 = 1e-3;

/// A direction at least this long may be taken for a heading.
const LONG_ENOUGH: f64 = 0.5;

/// No direction is known better along itself than by this variance.
const ALONG: f64 = 1e-9;

/// What `(c, s)` says of the heading.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Heading {
    /// \[rad\]
    pub heading_rad: f64,
    /// \[rad²\]
    pub variance: f64,
    /// `|(c, s)|`: 1 of a heading that is known exactly.
    pub length: f64,
}

impl Heading {
    /// Whether it is known to `sigma_rad`, and long enough to be a heading at all.
    #[must_use]
    pub fn is_ready(&self, sigma_rad: f64) -> bool {
        self.length >= LONG_ENOUGH && self.variance <= sigma_rad * sigma_rad
    }
}

/// Mean and covariance of `(cos φ, sin φ)` of a heading with this variance.
pub(crate) fn direction_of(heading_rad: f64, variance: f64) -> (Vector2<f64>, Matrix2<f64>) {
    let along = unit(heading_rad);
    let across = J * along;
    let covariance = along * along.transpose() * along_variance(variance)
        + across * across.transpose() * (-0.5 * libm::expm1(-2.0 * variance));
    (along * libm::exp(-0.5 * variance), covariance)
}

/// `½ (1 − e^(−v))² + 1e-9`
fn along_variance(variance: f64) -> f64 {
    let loss = -libm::expm1(-variance);
    0.5 * loss * loss + ALONG
}

impl State {
    /// What a linear state says of the heading; of nothing, any heading.
    #[must_use]
    pub fn heading_of(&self) -> Heading {
        let direction = self.direction();
        let length = direction.norm();
        if length < NO_DIRECTION {
            return Heading {
                heading_rad: 0.0,
                variance: PI * PI / 3.0,
                length,
            };
        }
        let across = J * direction / length;
        let spread = (across.transpose() * self.direction_covariance() * across).x;
        Heading {
            heading_rad: libm::atan2(direction.y, direction.x),
            variance: spread / (length * length),
            length,
        }
    }

    /// The linear state as one with a heading: `(c, s)` has the length of one, then the angle is taken of it.
    pub fn convert(&mut self) {
        let Heading {
            variance, length, ..
        } = self.heading_of();
        let direction = self.direction();
        let mut slopes = SMatrix::<f64, 1, SIZE>::zeros();
        slopes
            .fixed_view_mut::<1, 2>(0, 2)
            .copy_from(&(direction.transpose() / length));
        let linearised = Linearised {
            slopes,
            innovation: Vector1::new(libm::exp(-0.5 * variance) - length),
            noise: Matrix1::new(along_variance(variance)),
        };
        self.apply(&linearised, f64::INFINITY);
        let (direction, mut map) = (self.direction(), Covariance::identity());
        let row = (J * direction).transpose() / direction.norm_squared();
        map.fixed_view_mut::<2, 2>(2, 2).fill(0.0);
        map.fixed_view_mut::<1, 2>(2, 2).copy_from(&row);
        self.covariance = map * self.covariance * map.transpose();
        self.mean[2] = wrap(libm::atan2(direction.y, direction.x));
        self.mean[3] = 0.0;
        self.core = Core::Heading;
        self.symmetrise();
    }
}
