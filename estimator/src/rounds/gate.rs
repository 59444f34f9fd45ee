//! What of a round a robot believes: nothing that a joint update could not have made.
//!
//! A joint update moves a robot by `d = K r`, whose covariance is `D = f P(s) − P⁺`, and never makes it less certain than `f P(s)`; f is 1,
//! or the block bound's factor where somebody joined. So a leader that lies moves nobody farther than the gate allows for what it says it
//! has learned. That it has learned less than it says can be seen by nobody who has not all that it has: a covariance that is too small by
//! less than `LEAST` passes, and with it a move of as many standard deviations of what was shared as the gate has, and no more.

use core::fmt;

use nalgebra::{Matrix3, Vector3};

use super::{Correction, Shared};
use crate::angle::wrap;
use crate::covariance::Covariance3;
use crate::pose::Pose;

/// χ² with three degrees of freedom, 1 − 10⁻⁶: rounds are many.
pub const CHI2_3_ONE_IN_A_MILLION: f64 = 30.664_849_706_154_26;

/// Relative to what was shared; rounding of an honest leader is far below.
const ROUNDING: f64 = 1e-9;

/// A direction in which less was learned, relative to what was shared, is held against this: several measurements one after the other, each
/// linearised where the last one led, move a robot a little in directions in which they teach nothing.
const FLOOR: f64 = 1e-4;

/// A round leaves that much of a variance at least, relative: a thousandth of a standard deviation.
const LEAST: f64 = 1e-6;

/// Why a correction is refused.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// The robot shared nothing at that slot, or something has replaced its belief since.
    TookNoPart,
    /// A number is none, or the covariance is none or singular.
    NotABelief,
    /// The factor is less than 1 or more than a block bound of the team has.
    Factor,
    /// `P⁺` is not within `f P(s)`.
    LessCertain,
    /// `P⁺` is less than a round can leave of `f P(s)`.
    TooCertain,
    /// The move is too far for what is said to have been learned.
    TooFar,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TookNoPart => "the robot took no part in that round",
            Self::NotABelief => "a number or the covariance is none",
            Self::Factor => "the block bound's factor is none of this team's",
            Self::LessCertain => "the covariance is not within the one that was shared",
            Self::TooCertain => "the covariance is smaller than one round can make it",
            Self::TooFar => "the pose moves farther than what was learned allows",
        })
    }
}

/// Whether `told` may have come from an honest joint update of `shared` in a team of `robots`; `gate` is a quantile of χ² with three degrees
/// of freedom.
///
/// # Errors
/// Why not.
pub fn check(shared: &Shared, told: &Correction, robots: usize, gate: f64) -> Result<(), Refusal> {
    #[allow(clippy::cast_precision_loss)] // A team is small.
    let most = robots as f64;
    if !told.pose.is_finite() || !is_positive(&told.covariance) {
        return Err(Refusal::NotABelief);
    }
    if !(1.0..=most.max(1.0)).contains(&told.factor) {
        return Err(Refusal::Factor);
    }
    // In units of what was shared all of it is between nothing and everything.
    let Some(root) = (shared.covariance * told.factor).cholesky() else {
        return Err(Refusal::NotABelief);
    };
    let Some(left) = whitened(&root.l(), &told.covariance) else {
        return Err(Refusal::NotABelief);
    };
    let eigen = (Matrix3::identity() - left).symmetric_eigen();
    if eigen.eigenvalues.min() < -ROUNDING {
        return Err(Refusal::LessCertain);
    }
    if eigen.eigenvalues.max() > 1.0 - LEAST {
        return Err(Refusal::TooCertain);
    }
    let Pose { x, y, phi } = shared.pose;
    let turn = wrap(told.pose.phi - phi);
    let moved = Vector3::new(told.pose.x - x, told.pose.y - y, turn);
    let Some(moved) = root.l().solve_lower_triangular(&moved) else {
        return Err(Refusal::NotABelief);
    };
    let moved = eigen.eigenvectors.transpose() * moved;
    let d2 = moved
        .iter()
        .zip(eigen.eigenvalues.iter())
        .map(|(step, learned)| step * step / learned.max(FLOOR))
        .sum::<f64>();
    if d2 <= gate {
        Ok(())
    } else {
        Err(Refusal::TooFar)
    }
}

/// `L⁻¹ M L⁻ᵀ`, made symmetric.
fn whitened(root: &Matrix3<f64>, matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let half = root.solve_lower_triangular(matrix)?.transpose();
    let white = root.solve_lower_triangular(&half)?;
    Some(0.5 * (white + white.transpose()))
}

/// Whether the matrix is a covariance with something left in every direction.
fn is_positive(matrix: &Matrix3<f64>) -> bool {
    Covariance3::new(*matrix).is_ok() && matrix.cholesky().is_some()
}
