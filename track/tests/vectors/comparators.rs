//! The filters of the thesis: from a wrong start, and with a height.

use coloc_track::comparator::{
    FourState, Printed, SpatialReading, Traditional, euler, process_noise,
};
use coloc_track::{Core, State};
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use serde::Deserialize;

use crate::case::{check_covariance, check_mean, from_triangle, mount, read_vectors, state};

#[derive(Deserialize)]
struct Sequence {
    meta: Meta,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
struct Meta {
    dt: f64,
    T0: f64,
    x0: [f64; 3],
    P0: Vec<Vec<f64>>,
    var_r: f64,
    var_t: f64,
}

#[derive(Deserialize)]
struct Step {
    u_j: [f64; 2],
    u_i: [f64; 2],
    rho: Option<f64>,
    theta: Option<f64>,
    expected: Option<Expected>,
}

#[derive(Deserialize)]
struct Expected {
    plkf: Moments,
    ekf: Moments,
}

#[derive(Deserialize)]
struct Moments {
    x: Vec<f64>,
    P: Option<Vec<f64>>,
}

impl Moments {
    fn check(&self, name: &str, found: &State) {
        check_mean(name, found, &self.x, 1e-8);
        if let Some(entries) = &self.P {
            check_covariance(name, found, &from_triangle(entries, 3), 1e-7);
        }
    }
}

fn moved(state: &mut State, step: &Step, meta: &Meta) {
    let noise = |[v, _]: [f64; 2]| {
        let variances = Vector3::new(5.075 * v * v, 0.0, 0.345);
        Matrix3::from_diagonal(&variances) * (meta.T0 * meta.dt)
    };
    let all = process_noise(state, &noise(step.u_j), &noise(step.u_i));
    let [observer, seen] = [step.u_j, step.u_i].map(|[v, omega]| Vector3::new(v, 0.0, omega));
    euler(state, &observer, &seen, &all, meta.dt);
}

#[test]
fn from_a_wrong_start() {
    let Some(sequence) = read_vectors::<Sequence>("sequence_thesis.json") else {
        return;
    };
    let meta = &sequence.meta;
    let begun = state(Core::Heading, &meta.x0, &meta.P0);
    let (mut printed, mut traditional, mut compared) = (begun, begun, 0);
    for (index, step) in sequence.steps.iter().enumerate() {
        moved(&mut printed, step, meta);
        moved(&mut traditional, step, meta);
        if let (Some(rho), Some(theta)) = (step.rho, step.theta) {
            let white = [meta.var_r, meta.var_t];
            Printed.learn(&mut printed, rho, theta, white, &mount([0.0; 3]));
            Traditional.learn(&mut traditional, rho, theta, white);
        }
        if let Some(expected) = &step.expected {
            expected
                .plkf
                .check(&format!("PLKF, step {index}"), &printed);
            expected
                .ekf
                .check(&format!("EKF, step {index}"), &traditional);
            compared += 1;
        }
    }
    assert!(compared > 100, "{compared}");
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    match value {
        serde_json::Value::Array(list) => list.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn with_height(value: &serde_json::Value) -> FourState {
    FourState {
        mean: Vector4::from_column_slice(&numbers(&value["x"])),
        covariance: Matrix4::from_row_slice(&numbers(&value["P"])),
    }
}

fn check(name: &str, found: &FourState, expected: &serde_json::Value) {
    let expected = with_height(expected);
    let mean = (found.mean - expected.mean).abs().max();
    assert!(
        mean <= 1e-9 * expected.mean.abs().max().max(1.0),
        "{name}: {mean:e}"
    );
    let sigma = expected.covariance.diagonal().map(f64::sqrt);
    let errors = (found.covariance - expected.covariance).abs();
    let allowed = 1e-8 * sigma * sigma.transpose();
    let is_within = errors
        .iter()
        .zip(allowed.iter())
        .all(|(a, b)| *a <= b + 1e-18);
    assert!(is_within, "{name}: {errors}");
}

#[derive(Deserialize)]
struct File {
    cases: Vec<serde_json::Value>,
}

#[test]
fn predictions_with_a_height() {
    let Some(file) = read_vectors::<File>("predict.json") else {
        return;
    };
    let is_spatial = |it: &&serde_json::Value| it["input"]["x"].as_array().unwrap().len() == 4;
    let mut cases = file
        .cases
        .iter()
        .filter(|it| it["mode"] == "thesis" && is_spatial(it));
    let mut seen = 0;
    for case in &mut cases {
        let input = &case["input"];
        let mut found = with_height(input);
        let [observer, other] =
            ["u_j", "u_i"].map(|it| Vector4::from_column_slice(&numbers(&input[it])));
        let noise = Matrix4::from_row_slice(&numbers(&input["Q"]));
        found.euler(&observer, &other, &noise, input["dt"].as_f64().unwrap());
        check(&case["id"].to_string(), &found, &case["expected"]);
        seen += 1;
    }
    assert!(seen > 2);
}

#[test]
fn updates_with_a_height() {
    let Some(file) = read_vectors::<File>("update.json") else {
        return;
    };
    let mut seen = 0;
    for case in file
        .cases
        .iter()
        .filter(|it| it["input"]["core"] == "heading4")
    {
        let input = &case["input"];
        let number = |name: &str| input[name].as_f64().unwrap();
        let reading = SpatialReading {
            range_m: number("r"),
            azimuth_rad: number("th"),
            elevation_rad: number("al"),
            variances: ["vr", "vt", "va"].map(number),
        };
        let mut found = with_height(input);
        let outcome = if case["kind"] == "ekf_4dof" {
            found.traditional(&reading)
        } else {
            found.pseudo_linear(&reading, input["r_from"] == "estimate")
        };
        let d2 = case["expected"]["d2"].as_f64().unwrap();
        assert!((outcome.d2 - d2).abs() <= 1e-8 * d2, "{}", case["id"]);
        check(&case["id"].to_string(), &found, &case["expected"]);
        seen += 1;
    }
    assert!(seen > 5);
}
