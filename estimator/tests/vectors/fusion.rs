//! Algorithm 3, greedy and damped.

use coloc_estimator::settings::{Criterion, FusionSettings};
use coloc_estimator::{GlobalPose, Parts, fuse};
use serde::Deserialize;

use crate::case::{Case, File, Fused, Moments, Rows, covariance, fusion_tolerance, pose};
use crate::support::read_vectors;

#[derive(Deserialize)]
struct Received {
    #[serde(flatten)]
    prior: Moments,
    y_star: [f64; 3],
    R_ind: Rows,
    R_dep: Rows,
    criterion: String,
    gate: Option<f64>,
    beta: Option<f64>,
}

impl Received {
    fn message(&self) -> GlobalPose {
        let total =
            core::array::from_fn(|i| core::array::from_fn(|j| self.R_ind[i][j] + self.R_dep[i][j]));
        GlobalPose {
            pose: pose(self.y_star),
            parts: Parts::of(&covariance(&total), &covariance(&self.R_ind)),
        }
    }

    fn settings(&self) -> FusionSettings {
        let criterion = match self.criterion.as_str() {
            "trace" => Criterion::Trace,
            "det" => Criterion::Determinant,
            other => panic!("criterion {other}"),
        };
        FusionSettings {
            criterion,
            damping: self.beta.unwrap_or(1.0),
            gate: self.gate.unwrap_or(f64::INFINITY),
            ..FusionSettings::paper()
        }
    }
}

fn check_fusion(case: &Case<Received, Fused>) {
    let prior = case.input.prior.belief();
    let fusion = fuse(&prior, &case.input.message(), &case.input.settings());
    let (name, expected) = (case.name(), &case.expected);
    assert_eq!(
        fusion.accepted, expected.accepted,
        "{name}: d² = {}",
        fusion.d2
    );
    fusion_tolerance(case.tol).check(&name, &fusion.belief, &expected.moments);
    if !fusion.accepted {
        assert_eq!(fusion.belief, prior, "{name}");
    }
    if let Some(alpha) = expected.alpha.filter(|_| case.tol < 1e-3) {
        assert!(
            (fusion.alpha - alpha).abs() <= 1e-4,
            "{name}: α = {}, not {alpha}",
            fusion.alpha
        );
    }
    let inside = expected
        .alpha
        .is_none_or(|alpha| (1e-3..=1.0 - 1e-3).contains(&alpha));
    if inside {
        assert!(
            (fusion.d2 - expected.d2).abs() <= 1e-5 * expected.d2,
            "{name}: d² = {}",
            fusion.d2
        );
    }
}

#[test]
fn split_covariance_intersection() {
    for name in ["split_ci.json", "split_ci_damped.json"] {
        let Some(file) = read_vectors::<File<Received, Fused>>(name) else {
            return;
        };
        assert!(!file.cases.is_empty());
        file.cases.iter().for_each(check_fusion);
    }
}
