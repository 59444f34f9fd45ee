//! Position fixes.

use coloc_estimator::{Covariance2, fix};
use nalgebra::Matrix2;
use serde::Deserialize;

use crate::case::{CUBATURE, File, Fused, Moments};
use crate::support::read_vectors;

#[derive(Deserialize)]
struct Fix {
    #[serde(flatten)]
    prior: Moments,
    y: [f64; 2],
    R: [[f64; 2]; 2],
    gate: Option<f64>,
}

#[test]
fn position_fixes() {
    let Some(file) = read_vectors::<File<Fix, Fused>>("dgps.json") else {
        return;
    };
    assert!(!file.cases.is_empty());
    for case in &file.cases {
        let Fix { prior, y, R, gate } = &case.input;
        let noise = Covariance2::new(Matrix2::from_fn(|i, j| R[i][j])).unwrap();
        let updated = fix::update(&prior.belief(), *y, &noise, gate.unwrap_or(f64::INFINITY));
        let (name, expected) = (case.name(), &case.expected);
        assert_eq!(
            updated.accepted, expected.accepted,
            "{name}: d² = {}",
            updated.d2
        );
        assert!(
            (updated.d2 - expected.d2).abs() <= 1e-9 * expected.d2,
            "{name}: d² = {}",
            updated.d2
        );
        CUBATURE.check(&name, &updated.belief, &expected.moments);
        if !updated.accepted {
            assert_eq!(updated.belief, prior.belief(), "{name}");
        }
    }
}
