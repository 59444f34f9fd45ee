//! From range and bearing, as a sensor gives them, to a place in the body's frame.

use super::alone::Alone;
use super::symmetric::Symmetric2;
use crate::covariance::Covariance2;
use crate::pose::Pose;

/// How a sensor of range and bearing errs: `range = r (1 + s) + n_r`, `bearing = azimuth + b + n_θ`, the n white, s and b slow: for
/// seconds the same, and for all that is seen in one image.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct ReadingNoise {
    /// Variances of `n_r` and `n_θ` \[m², rad²\].
    pub white: [f64; 2],
    /// Standard deviations of s and b \[1, rad\]; zero: there is none.
    pub slow: [f64; 2],
}

/// What stands where in the body's frame, with the covariance of its noise in two parts.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct BodySighting {
    /// z \[m\]
    pub at: [f64; 2],
    /// `R_white`: of this sighting alone.
    pub white: Covariance2,
    /// `R_slow`: the same for other sightings too, so never independent.
    pub slow: Covariance2,
}

/// What a sensor says of what it sees.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Reading {
    /// Range and bearing: where it is.
    Place(BodySighting),
    /// One of the two.
    Alone(Alone),
}

impl Reading {
    /// All its numbers but the covariances, which are checked where they are made.
    pub(crate) fn numbers(&self) -> [f64; 5] {
        match self {
            Self::Place(it) => [it.at[0], it.at[1], 0.0, 0.0, 0.0],
            Self::Alone(
                Alone::Bearing {
                    bearing_rad: number,
                    variances: [_, slow],
                    mount,
                }
                | Alone::Range {
                    range_m: number,
                    variances: [_, slow],
                    mount,
                },
            ) => [*number, *slow, mount.x, mount.y, mount.phi],
        }
    }

    /// Variances of what is white of it.
    pub(crate) fn white(&self) -> [f64; 2] {
        match self {
            Self::Place(it) => it.white.variances(),
            Self::Alone(Alone::Bearing { variances, .. } | Alone::Range { variances, .. }) => {
                [variances[0]; 2]
            }
        }
    }

    /// With no white variance of a place below `floor` \[m²\].
    #[must_use]
    pub(crate) fn with_floor(&self, floor: [f64; 2]) -> Self {
        match self {
            Self::Place(it) => Self::Place(BodySighting {
                white: it.white.with_floor(floor),
                ..*it
            }),
            Self::Alone(_) => *self,
        }
    }
}

impl BodySighting {
    /// `z = m + C(μ) ρ (cos θ, sin θ)` of a sensor at `mount`, (m, μ) on the body.
    #[must_use]
    pub fn of(range_m: f64, bearing_rad: f64, mount: &Pose, noise: &ReadingNoise) -> Self {
        let (sin, cos) = libm::sincos(bearing_rad + mount.phi);
        let square = range_m * range_m;
        let across_and_along = |[along, across]: [f64; 2]| {
            let along = Symmetric2::outer(along, [cos, sin]);
            (along + Symmetric2::outer(square * across, [-sin, cos])).covariance()
        };
        let [scale, turn] = noise.slow;
        Self {
            at: [mount.x + range_m * cos, mount.y + range_m * sin],
            white: across_and_along(noise.white),
            slow: across_and_along([scale * scale * square, turn * turn]),
        }
    }
}
