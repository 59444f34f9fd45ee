//! Where a robot is.

use nalgebra::Vector3;

use crate::angle::wrap;

/// A pose in the plane (REP-103: x forward, y left, counter-clockwise): `x` \[m\], `y` \[m\], heading `phi`
/// \[rad\], wrapped to (−π, π].
///
/// In the common frame it is where a robot is; as a relative pose it is where another robot is in the
/// observer's body frame.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// \[m\]
    pub x: f64,
    /// \[m\]
    pub y: f64,
    /// Heading \[rad\], in (−π, π].
    pub phi: f64,
}

impl Pose {
    /// The pose with its heading wrapped to (−π, π].
    #[must_use]
    #[inline]
    pub fn new(x: f64, y: f64, phi: f64) -> Self {
        Self {
            x,
            y,
            phi: wrap(phi),
        }
    }

    /// `[x, y, φ]`.
    #[must_use]
    pub fn to_vector(self) -> Vector3<f64> {
        Vector3::new(self.x, self.y, self.phi)
    }

    /// Whether every coordinate is a finite number.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.phi.is_finite()
    }
}
