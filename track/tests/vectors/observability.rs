//! What can be known, of moments and of drives.

use coloc_estimator::angle::wrap;
use coloc_track::observability::{Drive, Input, Output, Sees, gramian, lie};
use nalgebra::Matrix3;
use serde::Deserialize;

use crate::case::read_vectors;

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Case {
    Lie {
        id: String,
        input: Moment,
        expected: Seen,
    },
    Gramian {
        id: String,
        input: Driven,
        expected: Known,
    },
}

#[derive(Deserialize)]
struct Moment {
    sensor: String,
    x: [f64; 3],
    theta: f64,
    inputs: Vec<String>,
    order: usize,
}

#[derive(Deserialize)]
struct Seen {
    rank: usize,
    observable: bool,
    gram: [[f64; 3]; 3],
}

#[derive(Deserialize)]
struct Driven {
    sensor: String,
    x0: [f64; 3],
    u_j: [f64; 3],
    u_i: [f64; 3],
    legs: usize,
    dt: f64,
    every: usize,
    var_r: f64,
    var_t: f64,
}

#[derive(Deserialize)]
struct Known {
    W: [[f64; 3]; 3],
    x_end: [f64; 3],
    rank: usize,
    log10_condition: Option<f64>,
    sigma_heading: Option<f64>,
}

fn close(name: &str, found: &Matrix3<f64>, expected: &[[f64; 3]; 3]) {
    let expected = Matrix3::from_row_slice(expected.as_flattened());
    let error = (found - expected).abs().max();
    assert!(
        error <= 1e-9 * expected.abs().max(),
        "{name}: off by {error:e}: {found}"
    );
}

fn check_moment(name: &str, input: &Moment, expected: &Seen) {
    let output = match input.sensor.as_str() {
        "range_bearing" => Output::RangeBearing,
        "bearing" => Output::Bearing,
        "bearing_nonlinear" => Output::BearingNonlinear,
        "range" => Output::Range,
        other => panic!("{other}"),
    };
    let motion = |it: &String| match it.as_str() {
        "vj" => Input::ObserverDrives,
        "wj" => Input::ObserverTurns,
        "vi" => Input::SeenDrives,
        "wi" => Input::SeenTurns,
        other => panic!("{other}"),
    };
    let inputs: Vec<Input> = input.inputs.iter().map(motion).collect();
    let found = lie(output, input.x, input.theta, &inputs, input.order);
    close(name, &found.gram, &expected.gram);
    assert_eq!(
        (found.rank, found.rank == 3),
        (expected.rank, expected.observable),
        "{name}"
    );
}

fn check_drive(name: &str, input: &Driven, expected: &Known) {
    let sees = match input.sensor.as_str() {
        "range_bearing" => Sees::RangeBearing,
        "bearing" => Sees::Bearing,
        "range" => Sees::Range,
        "range_bearing+reciprocal" => Sees::Reciprocal,
        other => panic!("{other}"),
    };
    let drive = Drive {
        start: input.x0,
        observer: input.u_j,
        seen: input.u_i,
        legs: input.legs,
        seconds: input.dt,
        every: input.every,
        variances: [input.var_r, input.var_t],
    };
    let found = gramian(sees, &drive);
    close(name, &found.information, &expected.W);
    for (i, (a, b)) in found.end.into_iter().zip(expected.x_end).enumerate() {
        let error = if i == 2 { wrap(a - b) } else { a - b };
        assert!(error.abs() <= 1e-9, "{name}: end {i} off by {error:e}");
    }
    assert_eq!(found.rank, expected.rank, "{name}");
    assert_eq!(
        found.heading_sigma.is_some(),
        expected.sigma_heading.is_some(),
        "{name}"
    );
    if let (Some(a), Some(b)) = (found.log10_condition, expected.log10_condition) {
        assert!((a - b).abs() <= 1e-4, "{name}: condition {a} is not {b}");
    }
    if let (Some(a), Some(b)) = (found.heading_sigma, expected.sigma_heading) {
        assert!((a - b).abs() <= 1e-6 * b, "{name}: σ {a} is not {b}");
    }
}

#[test]
fn every_case_is_as_observable_as_stated() {
    let Some(file) = read_vectors::<File>("observability.json") else {
        return;
    };
    assert!(file.cases.len() > 30);
    for case in &file.cases {
        match case {
            Case::Lie {
                id,
                input,
                expected,
            } => check_moment(id, input, expected),
            Case::Gramian {
                id,
                input,
                expected,
            } => check_drive(id, input, expected),
        }
    }
}
