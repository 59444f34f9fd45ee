//! Rivals that are special cases of Algorithm 3.

use coloc_estimator::settings::{Criterion, FusionSettings};
use coloc_estimator::{Belief, GlobalPose, Parts, fuse};
use serde::Deserialize;

use crate::case::{File, Moments, Rows, covariance, fusion_tolerance, pose};
use crate::support::read_vectors;

#[derive(Deserialize)]
struct Baseline {
    x: [f64; 3],
    P: Rows,
    y_star: [f64; 3],
    R_star: Rows,
    gate: Option<f64>,
}

#[derive(Deserialize)]
struct Baselined {
    accepted: bool,
    x: [f64; 3],
    P: Rows,
}

/// With nothing dependent the fusion is a Kalman filter's (`nb`), with nothing independent it is covariance
/// intersection (`ci_trace`, `ci_det`).
#[test]
fn rivals_that_are_special_cases() {
    let Some(file) = read_vectors::<File<Baseline, Baselined>>("baselines.json") else {
        return;
    };
    let mut checked = 0;
    for case in &file.cases {
        let (criterion, independent, tol) = match case.tag.as_str() {
            "nb" => (Criterion::Trace, true, 1e-9),
            "ci_trace" => (Criterion::Trace, false, 1e-6),
            "ci_det" => (Criterion::Determinant, false, 1e-6),
            _ => continue,
        };
        let Baseline {
            x,
            P,
            y_star,
            R_star,
            gate,
        } = &case.input;
        let (own, total) = (covariance(P), covariance(R_star));
        let all = if independent {
            Parts::independent
        } else {
            Parts::dependent
        };
        let prior = Belief::gaussian(pose(*x), all(own));
        let message = GlobalPose {
            pose: pose(*y_star),
            parts: all(total),
        };
        let gate = gate.unwrap_or(f64::INFINITY);
        let fusion = fuse(
            &prior,
            &message,
            &FusionSettings {
                criterion,
                gate,
                ..FusionSettings::paper()
            },
        );
        let Baselined { accepted, x, P } = case.expected;
        assert_eq!(fusion.accepted, accepted, "{}", case.name());
        let P_ind = fusion.belief.parts.independent.matrix();
        let P_ind = core::array::from_fn(|i| core::array::from_fn(|j| P_ind[(i, j)]));
        fusion_tolerance(tol).check(&case.name(), &fusion.belief, &Moments { x, P, P_ind });
        checked += 1;
    }
    assert!(checked > 0);
}
