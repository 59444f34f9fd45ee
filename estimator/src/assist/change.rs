//! What a stretch of a robot's own history makes of its error: `e := Φ e`, and news.
//!
//! A step takes the error along by F, which the way of the mean says; a measurement with white noise by what is left of the covariance.
//!
//! ```text
//! F = [[1, 0, −Δy], [0, 1, Δx], [0, 0, 1]]     I − K H = P⁺ (P⁻)⁻¹
//! ```
//!
//! Of what others say nobody can say it: their error may be the same. Nor of a fix's slow error, nor of a gyro's bias: the next one has
//! it again. For a heading's slow error stands white noise that is no less in any sum of headings.

use nalgebra::Matrix3;

use crate::covariance::Covariance3;
use crate::factor::Factor;
use crate::pose::Pose;

/// Φ of a stretch, or that nobody can say it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Change {
    by: Matrix3<f64>,
    is_known: bool,
}

/// Nothing happened.
impl Default for Change {
    fn default() -> Self {
        Self {
            by: Matrix3::identity(),
            is_known: true,
        }
    }
}

impl Change {
    /// Φ; `None` if nobody can say.
    pub(crate) fn by(&self) -> Option<&Matrix3<f64>> {
        self.is_known.then_some(&self.by)
    }

    /// A step of the odometry.
    pub(crate) fn go(&mut self, from: &Pose, to: &Pose) {
        self.by = moved(from, to) * self.by;
    }

    /// A measurement with white noise.
    pub(crate) fn learn(&mut self, before: &Covariance3, after: &Covariance3) {
        self.by = left(before, after) * self.by;
    }

    /// What nobody can say.
    pub(crate) fn break_off(&mut self) {
        self.is_known = false;
    }
}

/// F of the way between two means, of which no measurement has a part.
pub(crate) fn moved(from: &Pose, to: &Pose) -> Matrix3<f64> {
    let mut f = Matrix3::identity();
    f.m13 = from.y - to.y;
    f.m23 = to.x - from.x;
    f
}

/// `P⁺ (P⁻)⁻¹`; of what was known exactly nothing is left.
pub(crate) fn left(before: &Covariance3, after: &Covariance3) -> Matrix3<f64> {
    let inverse = Factor::new(&before.symmetric()).inverse();
    after.matrix() * Covariance3::trusted(&inverse).matrix()
}
