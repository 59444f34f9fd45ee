//! What is told, what is learnt of an answer, and single fusions.

use coloc_estimator::partial::{
    BodySighting, Innovation, Numbers, PositionSettings, SplitPosition, fuse, observed, tell,
};
use coloc_estimator::{Covariance2, Span};
use serde::Deserialize;

use crate::case::{Rows2, State, Tolerance, covariance2};
use crate::support::read_vectors;

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    id: String,
    tag: String,
    #[serde(flatten)]
    kind: Kind,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Kind {
    Forward {
        input: Seeing,
        expected: Told,
    },
    Backward {
        input: Answered,
        expected: Learnt,
    },
    Fuse {
        tol: f64,
        input: Box<Given>,
        expected: Fused,
    },
}

#[derive(Deserialize)]
struct Seeing {
    #[serde(flatten)]
    observer: State,
    z: [f64; 2],
    R_white: Rows2,
    R_slow: Rows2,
}

#[derive(Deserialize)]
struct Told {
    y: [f64; 2],
    R_i: Rows2,
    R_d: Rows2,
}

#[derive(Deserialize)]
struct Answered {
    #[serde(flatten)]
    seeing: Seeing,
    p_seen: [f64; 2],
    P_i_seen: Rows2,
    P_d_seen: Rows2,
}

#[derive(Deserialize)]
struct Learnt {
    nu: [f64; 2],
    H: [[f64; 3]; 2],
    Z: Rows2,
    R_i: Rows2,
    R_d: Rows2,
}

#[derive(Deserialize)]
struct Given {
    #[serde(flatten)]
    own: State,
    #[serde(flatten)]
    learnt: Learnt,
    beta: f64,
    lever: f64,
    /// None: everything is accepted.
    gate: Option<f64>,
}

#[derive(Deserialize)]
struct Fused {
    accepted: bool,
    alpha: Option<f64>,
    d2: f64,
    #[serde(flatten)]
    belief: State,
}

impl Seeing {
    fn sighting(&self) -> BodySighting {
        BodySighting {
            at: self.z,
            white: covariance2(&self.R_white),
            slow: covariance2(&self.R_slow),
        }
    }
}

impl Learnt {
    fn innovation(&self) -> Innovation {
        Innovation {
            numbers: Numbers::Two,
            difference: self.nu,
            by_state: self.H,
            by_direction: self.Z,
            independent: covariance2(&self.R_i),
            dependent: covariance2(&self.R_d),
        }
    }

    fn check(&self, name: &str, found: &Innovation) {
        close(name, "nu", &found.difference, &self.nu);
        close(
            name,
            "H",
            found.by_state.as_flattened(),
            self.H.as_flattened(),
        );
        close(
            name,
            "Z",
            found.by_direction.as_flattened(),
            self.Z.as_flattened(),
        );
        check_parts(
            name,
            [&found.independent, &found.dependent],
            [&self.R_i, &self.R_d],
        );
    }
}

fn close(name: &str, what: &str, found: &[f64], expected: &[f64]) {
    for (a, b) in found.iter().zip(expected) {
        assert!(
            (a - b).abs() <= 1e-9 * b.abs().max(1.0),
            "{name}: {what} {a} is not {b}"
        );
    }
}

/// Within the deviations of the sum, and no eigenvalue below rounding.
fn check_parts(name: &str, found: [&Covariance2; 2], expected: [&Rows2; 2]) {
    let [independent, dependent] = expected;
    let sigma: [f64; 2] = std::array::from_fn(|i| (independent[i][i] + dependent[i][i]).sqrt());
    for (part, (found, rows)) in found.into_iter().zip(expected).enumerate() {
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let error = (found.matrix()[(i, j)] - rows[i][j]).abs();
            let allowed = 1e-8 * sigma[i] * sigma[j] + 1e-18;
            assert!(
                error <= allowed,
                "{name}: part {part}[{i}][{j}] off by {error:e}, {allowed:e}"
            );
        }
        let least = found.matrix().symmetric_eigenvalues().min();
        let trace = sigma[0] * sigma[0] + sigma[1] * sigma[1];
        assert!(
            least >= -1e-14 * trace,
            "{name}: part {part} has the eigenvalue {least:e}"
        );
    }
}

fn check_fusion(name: &str, tol: f64, given: &Given, expected: &Fused) {
    let own = given.own.belief();
    let settings = PositionSettings {
        heading_lever_m: given.lever,
        damping: given.beta,
        memory: Span::ZERO,
        gate: given.gate.unwrap_or(f64::INFINITY),
        ..PositionSettings::default()
    };
    let found = fuse(&own, &given.learnt.innovation(), &settings);
    assert_eq!(found.accepted, expected.accepted, "{name}");
    if let Some(alpha) = expected.alpha {
        assert!(
            (found.alpha - alpha).abs() <= 1e-4,
            "{name}: α {} is not {alpha}",
            found.alpha
        );
    }
    if expected
        .alpha
        .is_some_and(|it| (1e-3..=1.0 - 1e-3).contains(&it))
    {
        let error = (found.d2 - expected.d2).abs();
        assert!(
            error <= 1e-5 * expected.d2,
            "{name}: d² {} is not {}",
            found.d2,
            expected.d2
        );
    }
    let tolerance = Tolerance {
        pose: |sigma| 1e-6 * sigma,
        relative: tol,
        beside: 0.0,
    };
    tolerance.check(name, &found.belief, &expected.belief);
    assert_eq!(found.belief == own, !found.accepted, "{name}");
}

#[test]
fn every_case_comes_out_as_stated() {
    let Some(file) = read_vectors::<File>("tracking/cooperative.json") else {
        return;
    };
    assert!(file.cases.len() > 80);
    for case in &file.cases {
        let name = format!("{} ({})", case.id, case.tag);
        match &case.kind {
            Kind::Forward { input, expected } => {
                let found = tell(&input.observer.belief(), &input.sighting());
                close(&name, "y", &found.position, &expected.y);
                let parts = [&found.independent, &found.dependent];
                check_parts(&name, parts, [&expected.R_i, &expected.R_d]);
            }
            Kind::Backward { input, expected } => {
                let answer = SplitPosition {
                    position: input.p_seen,
                    independent: covariance2(&input.P_i_seen),
                    dependent: covariance2(&input.P_d_seen),
                };
                let sighting = input.seeing.sighting();
                expected.check(
                    &name,
                    &observed(&input.seeing.observer.belief(), &sighting, &answer),
                );
            }
            Kind::Fuse {
                tol,
                input,
                expected,
            } => check_fusion(&name, *tol, input, expected),
        }
    }
}
