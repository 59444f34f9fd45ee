//! Single steps, conversions and measurements.

use coloc_estimator::honest::advance;
use coloc_estimator::settings::FusionSettings;
use coloc_estimator::{Belief, GlobalPose, Increments, Propagation, fix, fuse, to_global};
use serde::Deserialize;

use crate::case::{
    Rows, Rows2, State, Tolerance, Velocity, Wheels, covariance, covariance2, parts, pose, sigma,
};
use crate::support::read_vectors;

const STEP: Tolerance = Tolerance {
    pose: |value, _| 1e-9 * value.abs().max(1.0),
    covariance: [1e-9, 1e-24],
    bend: [1e-9, 1e-24],
    by_own: true,
};

const FIX: Tolerance = Tolerance {
    pose: STEP.pose,
    covariance: [1e-8, 0.0],
    bend: [1e-8, 0.0],
    by_own: false,
};

const SPLIT_CI: Tolerance = Tolerance {
    pose: |_, sigma| 1e-6 * sigma,
    covariance: [1e-6, 0.0],
    bend: [1e-6, 0.0],
    by_own: false,
};

#[derive(Deserialize)]
struct File<C> {
    cases: Vec<C>,
}

#[derive(Deserialize)]
struct Step {
    tag: String,
    input: Moving,
    expected: Stepped,
}

#[derive(Deserialize)]
struct Moving {
    #[serde(flatten)]
    state: State,
    motion: Given,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Given {
    Increments { t: [f64; 2], delta: f64, D: Rows },
    Velocity(Velocity),
    Wheels(Wheels),
}

#[derive(Deserialize)]
struct Stepped {
    t: [f64; 2],
    delta: f64,
    D: Rows,
    #[serde(flatten)]
    state: State,
}

impl Given {
    fn increments(&self) -> Increments {
        match self {
            Self::Increments { t, delta, D } => Increments {
                translation: *t,
                turn: *delta,
                noise: covariance(D),
            },
            Self::Velocity(velocity) => velocity.increments(),
            Self::Wheels(wheels) => wheels.increments(),
        }
    }

    fn drive(&self, belief: &Belief) -> Belief {
        match self {
            Self::Increments { .. } => advance(belief, &self.increments()).belief,
            Self::Velocity(velocity) => velocity.drive(belief),
            Self::Wheels(wheels) => wheels.drive(belief),
        }
    }
}

#[test]
fn steps() {
    let Some(file) = read_vectors::<File<Step>>("honest/step.json") else {
        return;
    };
    assert!(file.cases.len() > 50);
    for (index, case) in file.cases.iter().enumerate() {
        let name = format!("{index} ({})", case.tag);
        let (input, expected) = (&case.input, &case.expected);
        let increments = input.motion.increments();
        let [x, y] = increments.translation;
        let found = pose([x, y, increments.turn]);
        let measured = [expected.t[0], expected.t[1], expected.delta];
        STEP.check_pose(&format!("{name}: t, delta"), &found, measured, [0.0; 3]);
        let own = sigma(&expected.D);
        STEP.check_covariance(&format!("{name}: D"), &increments.noise, &expected.D, own);
        STEP.check(
            &name,
            &input.motion.drive(&input.state.belief()),
            &expected.state,
        );
    }
}

/// The map that a step returns is that of its linear part: of a small error of the state before.
#[test]
fn the_map_of_a_step_takes_an_error_of_the_state_along() {
    let Some(file) = read_vectors::<File<Step>>("honest/step.json") else {
        return;
    };
    for case in &file.cases {
        let (belief, increments) = (case.input.state.belief(), case.input.motion.increments());
        let moved = advance(&belief, &increments);
        let mut other = belief;
        other.pose = pose([belief.pose.x, belief.pose.y, belief.pose.phi + 1e-6]);
        let turned = advance(&other, &increments).belief.pose;
        let [x, y] = moved.map.by_heading.map(|it| 1e-6 * it);
        let way = increments
            .translation
            .iter()
            .map(|it| it.abs())
            .sum::<f64>();
        let allowed = 1e-11 * way + 1e-15 * (belief.pose.x.abs() + belief.pose.y.abs() + 1.0);
        let (dx, dy) = (
            turned.x - moved.belief.pose.x,
            turned.y - moved.belief.pose.y,
        );
        assert!(
            (dx - x).abs() < allowed && (dy - y).abs() < allowed,
            "{}",
            case.tag
        );
    }
}

#[derive(Deserialize)]
struct Convert {
    tag: String,
    input: Seeing,
    expected: Seen,
}

#[derive(Deserialize)]
struct Seeing {
    #[serde(flatten)]
    observer: State,
    z: [f64; 3],
    R: Rows,
}

#[derive(Deserialize)]
struct Seen {
    y: [f64; 3],
    R_i: Rows,
    R_d: Rows,
}

#[test]
fn conversions() {
    let Some(file) = read_vectors::<File<Convert>>("honest/convert.json") else {
        return;
    };
    assert!(file.cases.len() > 30);
    for (index, case) in file.cases.iter().enumerate() {
        let name = format!("{index} ({})", case.tag);
        let Seeing { observer, z, R } = &case.input;
        let (belief, noise) = (observer.belief(), covariance(R));
        let GlobalPose { pose: y, parts } =
            to_global(&belief, &pose(*z), &noise, Propagation::Honest);
        let Seen {
            y: stated,
            R_i,
            R_d,
        } = &case.expected;
        STEP.check_pose(&name, &y, *stated, [0.0; 3]);
        STEP.check_covariance(&format!("{name}: R_i"), &parts.independent, R_i, sigma(R_i));
        STEP.check_covariance(&format!("{name}: R_d"), &parts.dependent, R_d, sigma(R_d));
    }
}

#[derive(Deserialize)]
struct Update {
    tag: String,
    kind: String,
    input: Told,
    expected: Updated,
}

#[derive(Deserialize)]
struct Told {
    #[serde(flatten)]
    state: State,
    y: Vec<f64>,
    R: Option<Rows2>,
    R_i: Option<Rows>,
    R_d: Option<Rows>,
    beta: Option<f64>,
    gate: f64,
}

#[derive(Deserialize)]
struct Updated {
    accepted: bool,
    alpha: Option<f64>,
    d2: f64,
    #[serde(flatten)]
    state: State,
}

fn check_fix(name: &str, case: &Update) {
    let (
        Told {
            state, y, R, gate, ..
        },
        expected,
    ) = (&case.input, &case.expected);
    let noise = covariance2(&R.unwrap());
    let found = fix::update(&state.belief(), [y[0], y[1]], &noise, *gate);
    assert_eq!(found.accepted, expected.accepted, "{name}");
    assert!(
        (found.d2 - expected.d2).abs() <= 1e-9 * expected.d2,
        "{name}: d² {}",
        found.d2
    );
    FIX.check(name, &found.belief, &expected.state);
    assert_eq!(found.belief == state.belief(), !found.accepted, "{name}");
}

fn check_fusion(name: &str, case: &Update) {
    let (input, expected) = (&case.input, &case.expected);
    let settings = FusionSettings {
        damping: input.beta.unwrap(),
        gate: input.gate,
        ..FusionSettings::paper()
    };
    let message = GlobalPose {
        pose: pose([input.y[0], input.y[1], input.y[2]]),
        parts: parts(&input.R_i.unwrap(), &input.R_d.unwrap()),
    };
    let own = input.state.belief();
    let found = fuse(&own, &message, &settings);
    assert_eq!(found.accepted, expected.accepted, "{name}");
    assert!(
        (found.d2 - expected.d2).abs() <= 1e-5 * expected.d2,
        "{name}: d² {}",
        found.d2
    );
    assert!(
        (found.alpha - expected.alpha.unwrap()).abs() <= 1e-4,
        "{name}: α {}",
        found.alpha
    );
    SPLIT_CI.check(name, &found.belief, &expected.state);
    if !found.accepted {
        assert_eq!(found.belief, own, "{name}");
    }
}

#[test]
fn measurements() {
    let Some(file) = read_vectors::<File<Update>>("honest/update.json") else {
        return;
    };
    assert!(file.cases.len() > 20);
    for (index, case) in file.cases.iter().enumerate() {
        let name = format!("{index} ({})", case.tag);
        match case.kind.as_str() {
            "fix" => check_fix(&name, case),
            "split_ci" => check_fusion(&name, case),
            other => panic!("{other}"),
        }
    }
}
