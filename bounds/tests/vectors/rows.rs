//! `rows.json`

use coloc_bounds::{HalfPlane, Measurement, Seen, over_approximation};
use serde::Deserialize;

use crate::case::{Measured, Worst, read_vectors};

#[derive(Deserialize)]
struct Case {
    id: String,
    measurement: Measured,
    rows: Vec<[f64; 3]>,
    inside: Vec<[f64; 2]>,
    over_approximation: Option<f64>,
}

#[test]
fn half_planes_of_measurements() {
    let mut coefficients = Worst::new("rows, coefficients", 1e-12);
    let mut rhs = Worst::new("rows, right-hand sides", 1e-12);
    let mut outside = Worst::new("rows, truth outside by", 1e-9);
    let mut ratio = Worst::new("over-approximation", 1e-12);
    for case in read_vectors::<Case>("rows.json") {
        let id = &case.id;
        let measurement = case.measurement.measurement();
        measurement.check(2).unwrap();
        let mut found: Vec<HalfPlane> = Vec::new();
        measurement.half_planes(&mut |row| found.push(row));
        assert_eq!(found.len(), case.rows.len(), "{id}");
        for (found, &[x, y, expected]) in found.iter().zip(&case.rows) {
            coefficients.take(id, (found.normal[0] - x).abs());
            coefficients.take(id, (found.normal[1] - y).abs());
            rhs.take(id, (found.rhs - expected).abs() / (1.0 + expected.abs()));
            for point in &case.inside {
                let at = found.normal[0] * point[0] + found.normal[1] * point[1];
                outside.take(id, (at - found.rhs).max(0.0));
            }
        }
        if let Some(expected) = case.over_approximation {
            let Measurement::Between {
                seen: Seen::RangeBearing(bearing, range),
                ..
            } = measurement
            else {
                panic!("{id}: no range and bearing");
            };
            ratio.take(
                id,
                (over_approximation(bearing.half, range) / expected - 1.0).abs(),
            );
        }
    }
}
