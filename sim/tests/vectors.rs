//! The rival fusions against cases made by an independent implementation.

use std::path::PathBuf;

use coloc_estimator::angle::wrap;
use coloc_estimator::convert::GlobalPose;
use coloc_estimator::settings::Criterion;
use coloc_estimator::{Belief, Covariance3, Pace, Parts, Pose, Settings};
use coloc_sim::method::rule::Rule;
use nalgebra::Matrix3;
use serde_json::Value;

/// `COLOC_VECTORS`, or `../shared/vectors` of this folder or of one above it.
fn cases() -> Option<Vec<Value>> {
    let found = std::env::var_os("COLOC_VECTORS")
        .map(PathBuf::from)
        .or_else(|| {
            let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
            here.ancestors()
                .map(|folder| folder.join("../shared/vectors"))
                .find(|folder| folder.is_dir())
        });
    let Some(folder) = found else {
        eprintln!(
            "SKIPPED: no test vectors; set COLOC_VECTORS to the folder that holds baselines.json"
        );
        return None;
    };
    let text = std::fs::read_to_string(folder.join("baselines.json")).expect("baselines.json");
    let file: Value = serde_json::from_str(&text).expect("JSON");
    Some(file["cases"].as_array().expect("cases").clone())
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn pose(value: &Value) -> Pose {
    Pose::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| number(&value[row][column]))
}

fn covariance(value: &Value) -> Covariance3 {
    Covariance3::new(matrix(value)).expect("a covariance")
}

/// The rule of a case's tag, and how close its results must be.
fn rule(tag: &str, gate: f64) -> (Rule, f64) {
    let mut product = Settings::default();
    product.fusion.gate = gate;
    match tag {
        "nb" => (Rule::naive(&product), 1e-9),
        "ei" => (Rule::ellipsoidal(&product), 1e-9),
        "ci_trace" => (Rule::intersection(&product, Criterion::Trace), 1e-6),
        "ci_det" => (Rule::intersection(&product, Criterion::Determinant), 1e-6),
        other => panic!("unknown tag {other}"),
    }
}

fn assert_case(case: &Value) {
    let (id, input, expected) = (&case["id"], &case["input"], &case["expected"]);
    let (rule, tolerance) = rule(case["tag"].as_str().expect("a tag"), number(&input["gate"]));
    let own = Belief::independent(pose(&input["x"]), covariance(&input["P"]));
    let total = covariance(&input["R_star"]);
    let received = GlobalPose {
        pose: pose(&input["y_star"]),
        parts: Parts::dependent(total),
    };
    let fusion = rule.fuse(&own, &received, &Pace::default());
    assert_eq!(
        Some(fusion.accepted),
        expected["accepted"].as_bool(),
        "{id}"
    );
    let (found, stated) = (fusion.belief, pose(&expected["x"]));
    let (p, stated_p) = (found.total().matrix(), matrix(&expected["P"]));
    let sigma = stated_p.diagonal().map(f64::sqrt);
    let errors = [
        found.pose.x - stated.x,
        found.pose.y - stated.y,
        wrap(found.pose.phi - stated.phi),
    ];
    for i in 0..3 {
        assert!(
            errors[i].abs() <= tolerance * sigma[i] + 1e-12,
            "{id}: x[{i}] off by {:e}",
            errors[i]
        );
        for j in 0..3 {
            let error = (p[(i, j)] - stated_p[(i, j)]).abs();
            assert!(
                error <= tolerance * sigma[i] * sigma[j] + 1e-18,
                "{id}: P[{i}, {j}] off by {error:e}"
            );
        }
    }
}

#[test]
fn every_rival_fuses_as_the_vectors_say() {
    let Some(cases) = cases() else { return };
    assert_eq!(cases.len(), 48);
    cases.iter().for_each(assert_case);
}
