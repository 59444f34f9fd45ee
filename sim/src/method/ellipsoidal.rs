//! Ellipsoidal intersection (J. Sijs, M. Lazar, P. P. J. van den Bosch, "State fusion with unknown correlation:
//! Ellipsoidal intersection", American Control Conference 2010).
//!
//! The published formulas (Γ mutual covariance, γ mutual mean) in the basis B that makes both covariances
//! diagonal, `P = B Bᵀ`, `R = B D Bᵀ`, reduce to taking each coordinate of `B⁻¹ x` from whoever knows it better:
//!
//! ```text
//! Γ = B max(I, D) Bᵀ ;  P⁺ = (P⁻¹ + R⁻¹ − Γ⁻¹)⁻¹ = B min(I, D) Bᵀ
//! D_q < 1: γ_q = own, result = received ;  D_q > 1: γ_q = received, result = own ;  D_q = 1: the middle
//! ```
//!
//! The middle is what the published regularisation η → 0 gives.

use coloc_estimator::angle::wrap;
use coloc_estimator::convert::GlobalPose;
use coloc_estimator::fusion::Fusion;
use coloc_estimator::{Belief, Covariance3, Parts, Pose};
use nalgebra::{Matrix3, Vector3};

/// `own` after hearing `received`, if d² of `P + R` is at most `gate`. Singular covariances change nothing.
#[must_use]
pub fn fuse(own: &Belief, received: &GlobalPose, gate: f64) -> Fusion {
    let (p, r) = (own.total().matrix(), received.total().matrix());
    let mut innovation = received.pose.to_vector() - own.pose.to_vector();
    innovation.z = wrap(innovation.z);
    let d2 = (p + r).cholesky().map_or(f64::INFINITY, |root| {
        innovation.dot(&root.solve(&innovation))
    });
    let unchanged = Fusion {
        belief: *own,
        accepted: false,
        alpha: 1.0,
        d2,
    };
    if d2 > gate {
        return unchanged;
    }
    intersect(own, &p, &r, &innovation).map_or(unchanged, |belief| Fusion {
        belief,
        accepted: true,
        ..unchanged
    })
}

fn intersect(
    own: &Belief,
    p: &Matrix3<f64>,
    r: &Matrix3<f64>,
    innovation: &Vector3<f64>,
) -> Option<Belief> {
    let own_eigen = p.symmetric_eigen();
    if own_eigen.eigenvalues.min() <= 0.0 {
        return None;
    }
    let lengths = own_eigen.eigenvalues.map(f64::sqrt);
    let to_sphere = Matrix3::from_diagonal(&lengths.map(|length| 1.0 / length))
        * own_eigen.eigenvectors.transpose();
    let received = (to_sphere * r * to_sphere.transpose()).symmetric_eigen();
    let basis = own_eigen.eigenvectors * Matrix3::from_diagonal(&lengths) * received.eigenvectors;
    let innovation = received.eigenvectors.transpose() * to_sphere * innovation;
    let share = received.eigenvalues.map(share_of_received);
    let better = received.eigenvalues.map(|d| d.clamp(0.0, 1.0));
    let step = basis * share.component_mul(&innovation);
    let total = basis * Matrix3::from_diagonal(&better) * basis.transpose();
    let total = Covariance3::new(0.5 * (total + total.transpose())).ok()?;
    let Pose { x, y, phi } = own.pose;
    let pose = Pose::new(x + step.x, y + step.y, phi + step.z);
    Some(Belief::gaussian(pose, Parts::dependent(total)))
}

fn share_of_received(d: f64) -> f64 {
    if (d - 1.0).abs() < 1e-9 {
        0.5
    } else if d < 1.0 {
        1.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_coordinate_comes_from_whoever_knows_it_better() {
        let covariance = |variances| Covariance3::diagonal(variances).expect("positive");
        let own = Belief::independent(Pose::new(0.0, 0.0, 0.0), covariance([1.0, 4.0, 0.1]));
        let total = covariance([4.0, 1.0, 0.1]);
        let received = GlobalPose {
            pose: Pose::new(1.0, 1.0, 0.2),
            parts: Parts::independent(total),
        };
        let fused = fuse(&own, &received, f64::INFINITY).belief;
        assert!((fused.pose.to_vector() - Vector3::new(0.0, 1.0, 0.1)).norm() < 1e-12);
        assert!((fused.total().matrix().diagonal() - Vector3::new(1.0, 1.0, 0.1)).norm() < 1e-12);
    }

    #[test]
    fn what_is_far_off_changes_nothing() {
        let own = Belief::independent(
            Pose::default(),
            Covariance3::diagonal([1.0; 3]).expect("positive"),
        );
        let received = GlobalPose {
            pose: Pose::new(50.0, 0.0, 0.0),
            parts: own.parts,
        };
        let fused = fuse(&own, &received, 11.3);
        assert!(!fused.accepted);
        assert_eq!(fused.belief, own);
    }
}
