//! Predictions, updates, starts and conversions.

use coloc_track::comparator::{Printed, Traditional, euler};
use coloc_track::{Core, Gates, Increment, Outcome, Reading, Sensors, SlowErrors, State};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use crate::case::{check_covariance, check_mean, core, read_vectors, sensors, slow_errors, state};

type Rows = Vec<Vec<f64>>;

const MEAN: f64 = 1e-9;
const COVARIANCE: f64 = 1e-8;

#[derive(Deserialize)]
struct File<C> {
    cases: Vec<C>,
}

#[derive(Deserialize)]
struct Moments {
    x: Vec<f64>,
    P: Rows,
}

impl Moments {
    fn check(&self, name: &str, found: &State) {
        check_mean(name, found, &self.x, MEAN);
        check_covariance(name, found, &self.P, COVARIANCE);
    }
}

#[derive(Deserialize)]
struct Predict {
    id: String,
    tag: String,
    mode: String,
    input: Moving,
    expected: Moments,
}

#[derive(Deserialize)]
struct Moving {
    #[serde(flatten)]
    before: Moments,
    delta_j: Option<[f64; 3]>,
    D_j: Option<[[f64; 3]; 3]>,
    delta_i: Option<[f64; 3]>,
    D_i: Option<[[f64; 3]; 3]>,
    #[serde(default)]
    slow: Vec<[f64; 4]>,
    u_j: Option<Vec<f64>>,
    u_i: Option<Vec<f64>>,
    Q: Option<Rows>,
    dt: f64,
}

fn increment(displacement: Option<[f64; 3]>, covariance: Option<[[f64; 3]; 3]>) -> Increment {
    Increment {
        displacement: displacement.unwrap().into(),
        covariance: Matrix3::from_row_slice(covariance.unwrap().as_flattened()),
    }
}

/// A robot in the plane, by Euler's step.
fn by_euler(input: &Moving) -> State {
    let mut found = state(Core::Heading, &input.before.x, &input.before.P);
    let velocity = |it: &Option<Vec<f64>>| Vector3::from_column_slice(it.as_ref().unwrap());
    let noise = Matrix3::from_row_slice(&input.Q.as_ref().unwrap().concat());
    euler(
        &mut found,
        &velocity(&input.u_j),
        &velocity(&input.u_i),
        &noise,
        input.dt,
    );
    found
}

#[test]
fn predictions() {
    let Some(file) = read_vectors::<File<Predict>>("predict.json") else {
        return;
    };
    assert!(file.cases.len() > 60);
    for case in file
        .cases
        .iter()
        .filter(|it| !it.tag.contains("four degrees"))
    {
        let name = format!("{} ({})", case.id, case.tag);
        let input = &case.input;
        let found = if case.mode == "thesis" {
            by_euler(input)
        } else {
            let mut found = state(core(&case.mode), &input.before.x, &input.before.P);
            let slow = input.slow.iter().map(|it| slow_errors(*it));
            let (observer, seen) = (
                increment(input.delta_j, input.D_j),
                increment(input.delta_i, input.D_i),
            );
            found.predict(&observer, &seen, slow, input.dt);
            found
        };
        case.expected.check(&name, &found);
    }
}

#[derive(Deserialize)]
struct Update {
    id: String,
    tag: String,
    kind: String,
    input: Read,
    expected: Learnt,
}

#[derive(Deserialize)]
struct Read {
    core: String,
    #[serde(flatten)]
    before: Moments,
    gate: Option<f64>,
    rho: Option<f64>,
    theta: Option<f64>,
    var_r: Option<f64>,
    var_t: Option<f64>,
    r_from: Option<String>,
    k: Option<usize>,
    mount: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Learnt {
    accepted: bool,
    d2: f64,
    #[serde(flatten)]
    after: Moments,
}

impl Read {
    /// Sensors as many as there are slow errors; one without any if the reading is by such a one.
    fn sensors(&self, state: &State) -> Sensors {
        let count = if self.k.is_some() { state.slow } else { 0 };
        if count > 0 {
            return sensors(count, self.mount.unwrap_or_default(), SlowErrors::default());
        }
        let one = coloc_track::Sensor {
            mount: crate::case::mount(self.mount.unwrap_or_default()),
            slow: None,
        };
        Sensors::new(&[one]).unwrap()
    }

    fn reading(&self, kind: &str) -> Reading {
        match kind {
            "pl" => Reading::RangeBearing {
                range_m: self.rho.unwrap(),
                bearing_rad: self.theta.unwrap(),
                white: self.white(),
            },
            "range" => Reading::Range {
                range_m: self.rho.unwrap(),
                white: self.var_r.unwrap(),
            },
            "bearing" => Reading::Bearing {
                bearing_rad: self.theta.unwrap(),
                white: self.var_t.unwrap(),
            },
            other => panic!("{other}"),
        }
    }

    fn white(&self) -> [f64; 2] {
        [self.var_r.unwrap(), self.var_t.unwrap()]
    }

    fn apply(&self, kind: &str, state: &mut State) -> Outcome {
        let (all, gate) = (self.sensors(state), self.gate.unwrap_or(f64::INFINITY));
        let gates = Gates {
            one: gate,
            two: gate,
        };
        let from_estimate = self.r_from.as_deref() == Some("estimate");
        match kind {
            "reciprocal" => {
                state.update_reciprocal(self.theta.unwrap(), self.var_t.unwrap(), &gates)
            }
            "ekf" => Traditional.learn(state, self.rho.unwrap(), self.theta.unwrap(), self.white()),
            "pl" if from_estimate => {
                let mount = crate::case::mount(self.mount.unwrap_or_default());
                Printed.learn(
                    state,
                    self.rho.unwrap(),
                    self.theta.unwrap(),
                    self.white(),
                    &mount,
                )
            }
            kind => state.update(&self.reading(kind), &all, self.k.unwrap_or(0), &gates),
        }
    }
}

#[test]
fn updates() {
    let Some(file) = read_vectors::<File<serde_json::Value>>("update.json") else {
        return;
    };
    assert!(file.cases.len() > 100);
    let is_spatial = |it: &&serde_json::Value| it["input"]["core"] == "heading4";
    for case in file.cases.iter().filter(|it| !is_spatial(it)) {
        let case: Update = serde_json::from_value(case.clone()).unwrap();
        let name = format!("{} ({})", case.id, case.tag);
        let before = &case.input.before;
        let mut found = state(core(&case.input.core), &before.x, &before.P);
        let start = found;
        let outcome = case.input.apply(&case.kind, &mut found);
        assert_eq!(outcome.accepted, case.expected.accepted, "{name}");
        // Below rounding of the innovation there is nothing to compare.
        let error = (outcome.d2 - case.expected.d2).abs();
        assert!(
            error <= 1e-8 * case.expected.d2 + 1e-20,
            "{name}: d² {}",
            outcome.d2
        );
        case.expected.after.check(&name, &found);
        assert!(outcome.accepted || found == start, "{name}: changed");
    }
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Begin {
    Start {
        id: String,
        input: First,
        expected: Moments,
    },
    Convert {
        id: String,
        input: Moments,
        expected: Converted,
    },
    HeadingOf {
        id: String,
        input: Asked,
        expected: Said,
    },
    RelativePose {
        id: String,
        input: Told,
        expected: Pose,
    },
}

#[derive(Deserialize)]
struct First {
    rho: f64,
    theta: f64,
    var_r: f64,
    var_t: f64,
    slow: Vec<[f64; 4]>,
    k: Option<usize>,
    mount: [f64; 3],
}

#[derive(Deserialize)]
struct Said {
    heading: f64,
    variance: f64,
    length: f64,
    ready: Option<bool>,
}

#[derive(Deserialize)]
struct Converted {
    #[serde(flatten)]
    said: Said,
    #[serde(flatten)]
    after: Moments,
}

#[derive(Deserialize)]
struct Asked {
    #[serde(flatten)]
    state: Moments,
    sigma: f64,
}

#[derive(Deserialize)]
struct Told {
    mode: String,
    #[serde(flatten)]
    state: Moments,
}

#[derive(Deserialize)]
struct Pose {
    pose: [f64; 3],
    covariance: Rows,
}

impl First {
    /// Those with slow errors, and after them one without, by which the reading is if it has none.
    fn begun(&self) -> State {
        let with = |slow| coloc_track::Sensor {
            mount: crate::case::mount(self.mount),
            slow,
        };
        let mut all: Vec<_> = self
            .slow
            .iter()
            .map(|it| with(Some(slow_errors(*it))))
            .collect();
        all.push(with(None));
        let index = self.k.unwrap_or(all.len() - 1);
        let sensors = Sensors::new(&all).unwrap();
        State::start(
            self.rho,
            self.theta,
            [self.var_r, self.var_t],
            &sensors,
            index,
        )
    }
}

impl Said {
    fn check(&self, name: &str, state: &State, sigma: Option<f64>) {
        let found = state.heading_of();
        let turn = coloc_estimator::angle::wrap(found.heading_rad - self.heading);
        assert!(turn.abs() <= MEAN, "{name}: heading {}", found.heading_rad);
        let error = (found.variance - self.variance).abs();
        assert!(
            error <= COVARIANCE * self.variance,
            "{name}: variance {}",
            found.variance
        );
        assert!(
            (found.length - self.length).abs() <= MEAN,
            "{name}: length {}",
            found.length
        );
        if let (Some(ready), Some(sigma)) = (self.ready, sigma) {
            assert_eq!(found.is_ready(sigma), ready, "{name}");
        }
    }
}

#[test]
fn starts_and_conversions() {
    let Some(file) = read_vectors::<File<Begin>>("start.json") else {
        return;
    };
    assert!(file.cases.len() > 30);
    for case in &file.cases {
        match case {
            Begin::Start {
                id,
                input,
                expected,
            } => expected.check(id, &input.begun()),
            Begin::Convert {
                id,
                input,
                expected,
            } => {
                let mut found = state(Core::Linear, &input.x, &input.P);
                expected.said.check(id, &found, None);
                found.convert();
                expected.after.check(id, &found);
            }
            Begin::HeadingOf {
                id,
                input,
                expected,
            } => {
                let state = state(Core::Linear, &input.state.x, &input.state.P);
                expected.check(id, &state, Some(input.sigma));
            }
            Begin::RelativePose {
                id,
                input,
                expected,
            } => {
                let state = state(core(&input.mode), &input.state.x, &input.state.P);
                let (pose, covariance) = state.relative_pose();
                let numbers = pose.iter().zip(&expected.pose);
                assert!(
                    numbers.clone().all(|(a, b)| (a - b).abs() <= 1e-15),
                    "{id}: {pose:?}"
                );
                let wanted = Matrix3::from_row_slice(&expected.covariance.concat());
                assert!(
                    (covariance - wanted).abs().max() <= 1e-15,
                    "{id}: {covariance}"
                );
            }
        }
    }
}
