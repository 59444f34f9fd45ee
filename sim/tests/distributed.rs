//! The distributed filter against cases made by an independent joint filter, and against the centralized filter of a recording.

use std::path::PathBuf;

use coloc_estimator::angle::wrap;
use coloc_estimator::{Covariance3, Motion, Pose};
use coloc_rounds::model::{Kind, drive, predict, to_common_axes};
use coloc_sim::dkf::observability::{Sense, Setting, rank, stacked};
use coloc_sim::dkf::{Matrix, Measurement, Split, Team, Terms, Verdict, block, pose, propagate};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

const SPLITS: [Split; 2] = [Split::Trivial, Split::Mirrored];

/// A file of `COLOC_VECTORS`, or of `../shared/vectors` of this folder or of one above it.
fn file(name: &str) -> Option<Value> {
    let found = std::env::var_os("COLOC_VECTORS")
        .map(PathBuf::from)
        .or_else(|| {
            let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
            here.ancestors()
                .map(|folder| folder.join("../shared/vectors"))
                .find(|folder| folder.is_dir())
        });
    let folder = found.map(|folder| folder.join("distributed-kf"));
    let Some(folder) = folder.filter(|folder| folder.is_dir()) else {
        eprintln!(
            "SKIPPED: no test vectors; set COLOC_VECTORS to the folder that holds distributed-kf"
        );
        return None;
    };
    let text = std::fs::read_to_string(folder.join(name)).expect(name);
    Some(serde_json::from_str(&text).expect("JSON"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

fn numbers(value: &Value) -> Vec<f64> {
    list(value).iter().map(number).collect()
}

fn matrix(value: &Value) -> Matrix {
    let rows: Vec<Vec<f64>> = list(value).iter().map(numbers).collect();
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

fn column(entries: &[f64]) -> Matrix {
    Matrix::from_column_slice(entries.len(), 1, entries)
}

/// Writes `block` with its first entry at a place.
fn put(matrix: &mut Matrix, [row, column]: [usize; 2], block: &Matrix) {
    matrix
        .view_mut((row, column), block.shape())
        .copy_from(block);
}

fn matrix3(value: &Value) -> Matrix3<f64> {
    let all = matrix(value);
    Matrix3::from_fn(|i, j| {
        if i < all.nrows() && j < all.ncols() {
            all[(i, j)]
        } else {
            0.0
        }
    })
}

fn pose_of(value: &Value) -> Pose {
    let of = numbers(value);
    Pose::new(of[0], of[1], of[2])
}

fn robot(value: &Value) -> usize {
    usize::try_from(value.as_u64().expect("a robot")).expect("small") - 1
}

fn robots(value: &Value) -> Vec<usize> {
    list(value).iter().map(robot).collect()
}

fn kind(name: &str) -> Kind {
    match name {
        "pose" => Kind::Pose,
        "linear" => Kind::Linear,
        "bearing" => Kind::Bearing,
        "range" => Kind::Range,
        "range_bearing" => Kind::RangeBearing,
        "position" => Kind::Position,
        "absolute_pose" => Kind::AbsolutePose,
        other => panic!("unknown kind {other}"),
    }
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().expect("text")
}

/// The measurement of a round, linearised where the team is.
fn measurement(team: &Team, round: &Value) -> Measurement {
    match text(round, "kind") {
        "batch" => {
            let parts: Vec<_> = list(&round["parts"])
                .iter()
                .map(|part| measurement(team, part))
                .collect();
            Measurement::batch(&parts)
        }
        "given" => {
            let sides = [robot(&round["a"]), robot(&round["b"])];
            let h: Vec<Matrix> = list(&round["H"]).iter().map(matrix).collect();
            let mut residual = column(&numbers(&round["y"]));
            for (side, h) in sides.iter().zip(&h) {
                residual -= h * column(&team.nodes[*side].state);
            }
            Measurement {
                jacobians: sides.into_iter().zip(h).collect(),
                residual,
                noise: matrix(&round["R"]),
            }
        }
        name => {
            let kind = kind(name);
            let a = robot(&round["a"]);
            let b = round.get("b").map_or(a, robot);
            let mut y = [0.0; 3];
            for (y, value) in y.iter_mut().zip(numbers(&round["y"])) {
                *y = value;
            }
            let poses = [a, b].map(|it| pose(&team.nodes[it]));
            let noise = matrix3(&round["R"]);
            Measurement::of(kind, [a, b], [&poses[0], &poses[1]], y, &noise)
        }
    }
}

fn team(states: &Value, covariance: &Matrix, split: Split) -> Team {
    let states: Vec<Vec<f64>> = list(states).iter().map(numbers).collect();
    let n = states[0].len();
    let part =
        |l: usize, m: usize| Matrix::from_fn(n, n, |i, j| covariance[(n * l + i, n * m + j)]);
    let size = states.len();
    let nodes = states.into_iter().enumerate();
    let mut team = Team::new(nodes.map(|(l, x)| (x, part(l, l))).collect(), split);
    for l in 0..size {
        for m in l + 1..size {
            team.set_cross(l, m, part(l, m));
        }
    }
    team
}

/// P of the whole team.
fn joint(team: &Team) -> Matrix {
    let (size, n) = (team.nodes.len(), team.nodes[0].state.len());
    let mut all = Matrix::zeros(size * n, size * n);
    for l in 0..size {
        for m in 0..size {
            put(&mut all, [n * l, n * m], &team.cross(l, m));
        }
    }
    all
}

/// Relative to the standard deviations expected, and in the units of the state.
struct Tolerance {
    state: [f64; 2],
    covariance: f64,
}

const UPDATES: Tolerance = Tolerance {
    state: [1e-9, 1e-12],
    covariance: 1e-9,
};

const SEQUENCES: Tolerance = Tolerance {
    state: [0.0, 1e-9],
    covariance: 1e-8,
};

fn assert_states(id: &str, team: &Team, expected: &Value, sigma: &[f64], within: &Tolerance) {
    for (robot, (node, expected)) in team.nodes.iter().zip(list(expected)).enumerate() {
        let expected = numbers(expected);
        let n = expected.len();
        for i in 0..n {
            let mut error = node.state[i] - expected[i];
            if n == 3 && i == 2 {
                error = wrap(error);
            }
            let allowed = within.state[0] * sigma[n * robot + i] + within.state[1];
            assert!(
                error.abs() <= allowed,
                "{id}: x[{robot}][{i}] off by {error:e}"
            );
        }
    }
}

fn sigmas(covariance: &Matrix) -> Vec<f64> {
    (0..covariance.nrows())
        .map(|i| covariance[(i, i)].max(0.0).sqrt())
        .collect()
}

fn assert_covariance(id: &str, found: &Matrix, expected: &Matrix, within: f64) {
    let sigma = sigmas(expected);
    for i in 0..expected.nrows() {
        for j in 0..expected.ncols() {
            let error = (found[(i, j)] - expected[(i, j)]).abs();
            let allowed = within * sigma[i] * sigma[j] + 1e-18;
            assert!(error <= allowed, "{id}: P[{i}, {j}] off by {error:e}");
        }
    }
}

fn outcome(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Applied => "applied",
        Verdict::Gated => "gated",
        Verdict::Aborted => "aborted",
        Verdict::Singular => "singular",
    }
}

fn assert_d2(id: &str, found: Option<f64>, expected: &Value) {
    match (found, expected.as_f64()) {
        (Some(found), Some(expected)) => {
            let error = (found - expected).abs();
            assert!(
                error <= 1e-8 * expected.max(1e-12),
                "{id}: d² off by {error:e}"
            );
        }
        (found, None) => assert_eq!(found, None, "{id}"),
        (None, Some(_)) => panic!("{id}: no d²"),
    }
}

#[test]
fn models() {
    let Some(file) = file("models.json") else {
        return;
    };
    let close = |id: &str, found: f64, expected: f64| {
        let error = (found - expected).abs();
        assert!(
            error <= 1e-12 * expected.abs().max(1.0),
            "{id}: off by {error:e}"
        );
    };
    for case in list(&file["cases"]) {
        let (id, input, expected) = (text(case, "id"), &case["input"], &case["expected"]);
        let all = |found: &Matrix3<f64>, stated: &Value| {
            if stated.is_null() {
                assert_eq!(found.abs().max().to_bits(), 0.0_f64.to_bits(), "{id}");
                return;
            }
            for (i, row) in list(stated).iter().enumerate() {
                for (j, value) in numbers(row).into_iter().enumerate() {
                    close(id, found[(i, j)], value);
                }
            }
        };
        match text(case, "kind") {
            "motion" => {
                let u = numbers(&input["u"]);
                let noise = Covariance3::new(matrix3(&input["Q"])).expect("a covariance");
                let motion = Motion::Holonomic {
                    velocity: [u[0], u[1], u[2]],
                    noise,
                };
                let step = drive(&pose_of(&input["x"]), &motion, number(&input["dt"]));
                let (found, stated) = (step.pose.to_vector(), numbers(&expected["x"]));
                (0..2).for_each(|i| close(id, found[i], stated[i]));
                close(id, wrap(found[2] - stated[2]), 0.0);
                all(&step.jacobian, &expected["Phi"]);
                all(&step.noise, &expected["Q_d"]);
            }
            "to_common_axes" => {
                let y: [f64; 3] = numbers(&input["y"]).try_into().expect("three");
                let phi = number(&input["x_a"][2]);
                let (z, noise) = to_common_axes(phi, &Vector3::from(y), &matrix3(&input["R"]));
                let stated = numbers(&expected["z"]);
                (0..3).for_each(|i| close(id, z[i], stated[i]));
                all(&noise, &expected["R"]);
            }
            name => {
                let kind = kind(name);
                let a = pose_of(&input["x_a"]);
                let b = input.get("x_b").map_or(a, pose_of);
                let found = predict(kind, &a, &b);
                let stated = numbers(&expected["h"]);
                assert_eq!(stated.len(), kind.dimension(), "{id}");
                let mut y = [0.0; 3];
                y[..stated.len()].copy_from_slice(&stated);
                found.residual(y).iter().for_each(|it| close(id, *it, 0.0));
                all(&found.first, &expected["H_a"]);
                all(&found.second, &expected["H_b"]);
            }
        }
    }
}

#[test]
fn single_updates() {
    let Some(file) = file("updates.json") else {
        return;
    };
    let cases = list(&file["cases"]);
    assert_eq!(cases.len(), 38);
    for (case, split) in cases
        .iter()
        .flat_map(|case| SPLITS.map(|split| (case, split)))
    {
        let (id, input, expected) = (text(case, "id"), &case["input"], &case["expected"]);
        let mut team = team(&input["x"], &matrix(&input["P"]), split);
        let measured = measurement(&team, &input["measurement"]);
        let terms = Terms {
            gate: input["gate"].as_f64().unwrap_or(f64::INFINITY),
            silent: input["silent"].as_bool().expect("yes or no"),
            unreachable: &[],
        };
        let report = team.update(&measured, &terms);
        assert_eq!(outcome(report.verdict), text(expected, "outcome"), "{id}");
        if report.verdict != Verdict::Singular {
            assert_d2(id, report.d2, &expected["d2"]);
        }
        // What is not applied changes nothing.
        let after = if report.verdict == Verdict::Applied {
            expected
        } else {
            input
        };
        let stated = matrix(&after["P"]);
        assert_states(id, &team, &after["x"], &sigmas(&stated), &UPDATES);
        assert_covariance(id, &joint(&team), &stated, UPDATES.covariance);
    }
}

#[test]
fn what_is_observable() {
    let Some(file) = file("observability.json") else {
        return;
    };
    let cases = list(&file["cases"]);
    assert_eq!(cases.len(), 12);
    for case in cases {
        let id = text(case, "id");
        let sense = |kind, a, b| Sense { kind, a, b };
        let absolute = match text(case, "absolute") {
            "absolute pose of robot 1" => Some(sense(Kind::AbsolutePose, 0, 0)),
            "position of robot 1" => Some(sense(Kind::Position, 0, 0)),
            "none" => None,
            other => panic!("{other}"),
        };
        let between = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| sense(kind(text(case, "kind")), a, b));
        let motions = list(&case["u"]).iter().map(|u| {
            let u = numbers(u);
            [u[0], u[1], u[2]]
        });
        let moving = case["moving"].as_bool().expect("yes or no");
        let setting = Setting {
            poses: list(&case["x"]).iter().map(pose_of).collect(),
            motions: moving.then(|| motions.collect()),
            dt_s: number(&case["dt"]),
            instants: usize::try_from(case["instants"].as_u64().expect("a number")).expect("few"),
            senses: absolute.into_iter().chain(between).collect(),
        };
        let found = stacked(&setting);
        assert_eq!(
            Some(rank(&found) as u64),
            case["expected"]["rank"].as_u64(),
            "{id}"
        );
        let values = numbers(&case["expected"]["singular_values"]);
        for (found, stated) in found.singular_values().iter().zip(&values) {
            assert!(
                (found - stated).abs() <= 1e-9 * values[0],
                "{id}: {found} for {stated}"
            );
        }
    }
}

/// The paper's experiment: meetings with residual 0 at 320 and 720.
fn assert_paper(name: &str) {
    let Some(file) = file(name) else { return };
    let meta = &file["meta"];
    let mut team = team(&meta["x0"], &Matrix::zeros(9, 9), Split::Trivial);
    let noise = Covariance3::new(matrix3(&meta["Q"])).expect("a covariance");
    let mut events = list(&file["events"]).iter().peekable();
    let check = |team: &Team, event: &Value| {
        let id = format!("{name} {} {}", event["step"], event["moment"]);
        let stated = matrix(&event["P"]);
        assert_states(&id, team, &event["x"], &sigmas(&stated), &SEQUENCES);
        assert_covariance(&id, &joint(team), &stated, SEQUENCES.covariance);
    };
    for step in 1..=1000_u64 {
        for (robot, u) in list(&meta["u"]).iter().enumerate() {
            let u = numbers(u);
            let motion = Motion::Holonomic {
                velocity: [u[0], u[1], u[2]],
                noise,
            };
            propagate(&mut team.nodes[robot], &motion, number(&meta["dt"]));
        }
        assert!(
            step > 320 || team.traffic().messages == 0,
            "motion needs no message"
        );
        while let Some(event) = events.next_if(|event| event["step"].as_u64() == Some(step)) {
            if event["moment"] == "after" {
                let sides = robots(&event["meeting"]);
                let [a, b] = [sides[0], sides[1]];
                let poses = [a, b].map(|it| pose(&team.nodes[it]));
                let kind = kind(text(meta, "kind"));
                let y = predict(kind, &poses[0], &poses[1]).value.into();
                let r = matrix3(&meta["R"]);
                let met = Measurement::of(kind, [a, b], [&poses[0], &poses[1]], y, &r);
                let report = team.update(&met, &Terms::default());
                assert_eq!(report.participants, robots(&event["participants"]));
            }
            check(&team, event);
        }
    }
    assert!(events.next().is_none());
}

#[test]
fn the_papers_experiment_in_common_axes() {
    assert_paper("paper_linear.json");
}

#[test]
fn the_papers_experiment_by_relative_poses() {
    assert_paper("paper_ekf.json");
}

#[test]
fn linear_systems() {
    let Some(file) = file("linear.json") else {
        return;
    };
    let meta = &file["meta"];
    for split in SPLITS {
        let blocks: Vec<Matrix> = list(&meta["P0"]).iter().map(matrix).collect();
        let mut p0 = Matrix::zeros(8, 8);
        for (robot, block) in blocks.iter().enumerate() {
            put(&mut p0, [2 * robot; 2], block);
        }
        let mut team = team(&meta["x0"], &p0, split);
        let [f, q] = ["F", "Q_d"].map(|it| list(&meta[it]).iter().map(matrix).collect::<Vec<_>>());
        for (step, at) in list(&file["steps"]).iter().enumerate() {
            for (node, (f, q)) in team.nodes.iter_mut().zip(f.iter().zip(&q)) {
                let moved = f * column(&node.state);
                node.propagate(moved.as_slice().to_vec(), f, q);
            }
            if let Some(round) = at.get("round") {
                let report = team.update(&measurement(&team, round), &Terms::default());
                assert_eq!(report.verdict, Verdict::Applied);
                assert_eq!(report.participants, robots(&round["participants"]));
            }
            if let Some(expected) = at.get("expected") {
                let id = format!("linear, step {step}");
                let stated = matrix(&expected["P"]);
                assert_states(&id, &team, &expected["x"], &sigmas(&stated), &SEQUENCES);
                assert_covariance(&id, &joint(&team), &stated, SEQUENCES.covariance);
            }
        }
    }
}

/// Row by row of the triangle above and the diagonal.
fn from_triangle(of: &[f64]) -> Matrix {
    let place = |i: usize, j: usize| [0, 3, 5][i] + j - i;
    Matrix::from_fn(3, 3, |i, j| of[place(i.min(j), i.max(j))])
}

fn expected_joint(expected: &Value, size: usize) -> Matrix {
    let mut all = Matrix::zeros(3 * size, 3 * size);
    for (l, own) in list(&expected["P"]).iter().enumerate() {
        put(&mut all, [3 * l; 2], &from_triangle(&numbers(own)));
    }
    for cross in list(&expected["P_cross"]) {
        let (l, m, entries) = (robot(&cross[0]), robot(&cross[1]), numbers(&cross[2]));
        let block = Matrix::from_fn(3, 3, |i, j| entries[3 * i + j]);
        put(&mut all, [3 * l, 3 * m], &block);
        put(&mut all, [3 * m, 3 * l], &block.transpose());
    }
    all
}

fn count(value: &Value) -> usize {
    usize::try_from(value.as_u64().expect("a count")).expect("few")
}

fn assert_sequence(name: &str, split: Split) {
    let Some(file) = file(name) else { return };
    let meta = &file["meta"];
    let size = list(&meta["x0"]).len();
    let mut p0 = Matrix::zeros(3 * size, 3 * size);
    for (robot, own) in list(&meta["P0"]).iter().enumerate() {
        put(&mut p0, [3 * robot; 2], &block(&matrix3(own)));
    }
    let mut team = team(&meta["x0"], &p0, split);
    let noises: Vec<Covariance3> = list(&meta["Q"])
        .iter()
        .map(|q| Covariance3::new(matrix3(q)).expect("a covariance"))
        .collect();
    let silent_fixes = meta["silent_fixes"].as_bool().expect("yes or no");
    let (mut applied, mut gated, mut aborted, mut most) = (0, 0, 0, 0);
    // Batches and silent fixes are not in the totals of what is sent.
    let (mut numbers_sent, mut pi_numbers) = (0, 0);
    for (step, at) in list(&file["steps"]).iter().enumerate() {
        let before = team.traffic();
        for (robot, u) in list(&at["u"]).iter().enumerate() {
            let u = numbers(u);
            let motion = Motion::Holonomic {
                velocity: [u[0], u[1], u[2]],
                noise: noises[robot],
            };
            propagate(&mut team.nodes[robot], &motion, number(&meta["dt"]));
        }
        assert_eq!(team.traffic(), before, "motion needs no message");
        for round in at.get("rounds").map(list).unwrap_or_default() {
            let id = format!("{name}, step {step}");
            let measured = measurement(&team, round);
            let is_fix = text(round, "kind") == "position";
            let terms = Terms {
                gate: number(&meta["gate_by_dimension"][measured.dimension().to_string()]),
                silent: is_fix && silent_fixes,
                unreachable: &robots(&round["unreachable"]),
            };
            let before = team.traffic();
            let report = team.update(&measured, &terms);
            let after = team.traffic();
            assert_eq!(
                outcome(report.verdict),
                text(&round["expected"], "outcome"),
                "{id}"
            );
            assert_eq!(
                report.participants,
                robots(&round["expected"]["participants"]),
                "{id}"
            );
            assert_d2(&id, report.d2, &round["expected"]["d2"]);
            match report.verdict {
                Verdict::Applied => applied += 1,
                Verdict::Gated => gated += 1,
                Verdict::Aborted => aborted += 1,
                Verdict::Singular => panic!("{id}"),
            }
            if report.verdict == Verdict::Applied {
                most = most.max(report.participants.len());
                if !terms.silent && text(round, "kind") != "batch" {
                    numbers_sent += after.numbers - before.numbers;
                    pi_numbers += after.pi_numbers - before.pi_numbers;
                }
            }
        }
        if let Some(expected) = at.get("expected") {
            let id = format!("{name}, step {step}");
            if let Some(states) = expected.get("x") {
                assert_states(&id, &team, states, &vec![0.0; 3 * size], &SEQUENCES);
            }
            if expected.get("P").is_some() {
                let stated = expected_joint(expected, size);
                assert_covariance(&id, &joint(&team), &stated, SEQUENCES.covariance);
            }
        }
    }
    let totals = &meta["totals"];
    assert_eq!(applied, count(&totals["applied"]));
    assert_eq!(gated, count(&totals["gated"]));
    assert_eq!(aborted, count(&totals["aborted"]));
    assert_eq!(most, count(&totals["most_participants"]));
    assert_eq!(numbers_sent, count(&totals["floats_faithful"]));
    assert_eq!(pi_numbers, count(&totals["floats_pi"]));
}

#[test]
fn relative_poses_and_fixes() {
    for split in SPLITS {
        assert_sequence("sequence_a.json", split);
    }
}

#[test]
fn bearings_ranges_poses_fixes_and_outliers() {
    for split in SPLITS {
        assert_sequence("sequence_b.json", split);
    }
}

#[test]
fn rounds_that_lose_robots() {
    for split in SPLITS {
        assert_sequence("sequence_c.json", split);
    }
}

#[test]
fn batches_and_silent_fixes() {
    for split in SPLITS {
        assert_sequence("sequence_d.json", split);
    }
}
