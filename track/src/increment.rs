//! How a robot moved, in its own frame at the start.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// `Δ = [t, ψ]` with its covariance D.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Increment {
    /// `[x, y, ψ]` \[m, m, rad\]
    pub displacement: Vector3<f64>,
    /// D \[m², m·rad, rad²\]
    pub covariance: Matrix3<f64>,
}

/// How fast a robot moves, and how fast the variance of that grows.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Rate {
    /// `[v_x, v_y, ω]` \[m/s, rad/s\]
    pub velocity: Vector3<f64>,
    /// Of the displacement, in a second \[m²/s, m·rad/s, rad²/s\].
    pub covariance_per_s: Matrix3<f64>,
}

impl Increment {
    pub(crate) fn translation(&self) -> Vector2<f64> {
        self.displacement.xy()
    }

    pub(crate) fn turn(&self) -> f64 {
        self.displacement.z
    }

    /// `D_tt`
    pub(crate) fn translation_covariance(&self) -> Matrix2<f64> {
        self.covariance.fixed_view::<2, 2>(0, 0).into_owned()
    }

    /// `D_ψψ`
    pub(crate) fn turn_variance(&self) -> f64 {
        self.covariance.m33
    }
}

impl Rate {
    /// Nothing is known but how fast a robot may be: these variances in a second.
    #[must_use]
    pub fn unknown(variances_per_s: [f64; 3]) -> Self {
        Self {
            velocity: Vector3::zeros(),
            covariance_per_s: Matrix3::from_diagonal(&variances_per_s.into()),
        }
    }

    /// Of an increment that took `seconds`.
    #[must_use]
    pub fn of(increment: &Increment, seconds: f64) -> Self {
        Self {
            velocity: increment.displacement / seconds,
            covariance_per_s: increment.covariance / seconds,
        }
    }

    /// What becomes of it in `seconds`.
    #[must_use]
    pub fn over(&self, seconds: f64) -> Increment {
        Increment {
            displacement: self.velocity * seconds,
            covariance: self.covariance_per_s * seconds,
        }
    }
}
