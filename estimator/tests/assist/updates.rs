//! Fixes, headings and poses of a leader; what a child makes of data.

use coloc_estimator::assist::cross;
use coloc_estimator::assist::fusion::Rule;
use coloc_estimator::assist::kalman;
use coloc_estimator::heading::{self, HeadingNoise};
use coloc_estimator::settings::{Criterion, FusionSettings};
use coloc_estimator::{
    Belief, Covariance2, FixUpdate, GlobalPose, Parts, Propagation, RobotId, fix,
};
use serde::Deserialize;

use crate::case::{Rows, Tolerance, covariance, datum, matrix, pose, sigma};
use crate::support::read_vectors;

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    id: String,
    tag: String,
    tol: Option<f64>,
    #[serde(flatten)]
    kind: Kind,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Kind {
    Position {
        input: Absolute,
        expected: Updated,
    },
    Heading {
        input: Absolute,
        expected: Updated,
    },
    Pose {
        input: Absolute,
        expected: Updated,
    },
    Child {
        input: Box<Child>,
        expected: Box<Fused>,
    },
    Cross {
        input: Box<Cross>,
        expected: Box<Crossed>,
    },
}

#[derive(Deserialize)]
struct Absolute {
    x: [f64; 3],
    P: Rows,
    y: Vec<f64>,
    R: Vec<Vec<f64>>,
    gate: Option<f64>,
}

#[derive(Deserialize)]
struct Updated {
    accepted: bool,
    d2: f64,
    x: [f64; 3],
    P: Rows,
}

#[derive(Deserialize)]
struct Child {
    x: [f64; 3],
    P: Rows,
    P_ind: Rows,
    fusion: Fusion,
    data: Vec<Datum>,
}

#[derive(Deserialize)]
pub(crate) struct Fusion {
    kind: String,
    gate: Option<f64>,
    criterion: Option<String>,
    beta: Option<f64>,
    reset: Option<bool>,
}

impl Fusion {
    pub(crate) fn rule(&self) -> Rule {
        let gate = self.gate.unwrap_or(f64::INFINITY);
        if self.kind == "kf" {
            return Rule::Kalman { gate };
        }
        let criterion = match self.criterion.as_deref() {
            Some("trace") => Criterion::Trace,
            Some("det") => Criterion::Determinant,
            other => panic!("criterion {other:?}"),
        };
        Rule::Split {
            settings: FusionSettings {
                criterion,
                damping: self.beta.unwrap(),
                gate,
                ..FusionSettings::paper()
            },
            reset: self.reset.unwrap(),
        }
    }
}

#[derive(Deserialize)]
pub(crate) struct Datum {
    leader: u16,
    y_star: [f64; 3],
    R_star: Rows,
    R_ind: Rows,
}

impl Datum {
    pub(crate) fn said(&self) -> (RobotId, GlobalPose) {
        let said = datum(self.y_star, &self.R_star, &self.R_ind);
        (RobotId(self.leader), said)
    }
}

/// Of a fusion: leader, d², whether it was accepted, α.
type Line = (u16, f64, bool, Option<f64>);

#[derive(Deserialize)]
struct Fused {
    x: [f64; 3],
    P: Rows,
    P_ind: Option<Rows>,
    log: Vec<Line>,
}

#[derive(Deserialize)]
struct Cross {
    x: [f64; 3],
    P: Rows,
    C: Rows,
    leader_x: [f64; 3],
    leader_P: Rows,
    Phi: Rows,
    y_star: [f64; 3],
    R_ind: Rows,
    gate: Option<f64>,
}

#[derive(Deserialize)]
struct Crossed {
    accepted: bool,
    d2: f64,
    x: [f64; 3],
    P: Rows,
    C: Rows,
}

fn tolerance(tol: f64) -> Tolerance {
    if tol > 1e-9 {
        return Tolerance::new(|_, sigma| 1e-6 * sigma + 1e-12, (tol, 1e-18));
    }
    Tolerance::new(|_, sigma| 1e-9 * sigma + 1e-12, (1e-9, 1e-18))
}

impl Absolute {
    fn own(&self) -> Belief {
        Belief::independent(pose(self.x), covariance(&self.P))
    }

    fn gate(&self) -> f64 {
        self.gate.unwrap_or(f64::INFINITY)
    }

    fn position(&self) -> FixUpdate {
        let R = [self.R[0][0], self.R[0][1], self.R[1][0], self.R[1][1]];
        let noise = Covariance2::from_row_major(R).unwrap();
        fix::update(&self.own(), [self.y[0], self.y[1]], &noise, self.gate())
    }

    fn heading(&self) -> FixUpdate {
        let noise = HeadingNoise::white(self.R[0][0]);
        heading::update(&self.own(), self.y[0], &noise, self.gate())
    }

    fn pose(&self) -> FixUpdate {
        let R: Rows = std::array::from_fn(|i| std::array::from_fn(|j| self.R[i][j]));
        let y = pose([self.y[0], self.y[1], self.y[2]]);
        kalman::update(&self.own(), &y, &covariance(&R), self.gate())
    }
}

impl Updated {
    fn check(&self, name: &str, found: &FixUpdate, tolerance: &mut Tolerance) {
        assert_eq!(found.accepted, self.accepted, "{name}");
        let of = sigma(&self.P);
        tolerance.within(&format!("{name}: d²"), found.d2 - self.d2, 1e-5 * self.d2);
        tolerance.pose(name, &found.belief.pose, self.x, of);
        let total = found.belief.total().matrix();
        tolerance.matrix(&format!("{name}: P"), &total, &self.P, (of, of));
    }
}

fn check_line(name: &str, stated: &Line, found: (RobotId, &coloc_estimator::Fusion)) {
    let (leader, d2, accepted, alpha) = *stated;
    let (RobotId(number), fusion) = found;
    assert_eq!((number, fusion.accepted), (leader, accepted), "{name}");
    if let Some(alpha) = alpha {
        assert!(
            (fusion.alpha - alpha).abs() <= 1e-4,
            "{name}: α {} {alpha}",
            fusion.alpha
        );
    }
    if alpha.is_none_or(|alpha| (1e-3..=1.0 - 1e-3).contains(&alpha)) {
        assert!(
            (fusion.d2 - d2).abs() <= 1e-5 * d2,
            "{name}: d² {}",
            fusion.d2
        );
    }
}

impl Child {
    fn check(&self, name: &str, expected: &Fused, tolerance: &mut Tolerance) {
        let parts = Parts::of(&covariance(&self.P), &covariance(&self.P_ind));
        let own = Belief::gaussian(pose(self.x), parts);
        let data: Vec<_> = self.data.iter().map(Datum::said).collect();
        let mut stated = expected.log.iter();
        let found = self.fusion.rule().fuse_all(&own, &data, |leader, fusion| {
            check_line(name, stated.next().unwrap(), (leader, fusion));
        });
        assert!(stated.next().is_none(), "{name}");
        let of = sigma(&expected.P);
        tolerance.pose(name, &found.pose, expected.x, of);
        let name = format!("{name}: P");
        tolerance.matrix(&name, &found.total().matrix(), &expected.P, (of, of));
        if let Some(P_ind) = &expected.P_ind {
            let independent = found.parts.independent.matrix();
            tolerance.matrix(&format!("{name}_ind"), &independent, P_ind, (of, of));
        }
    }
}

impl Cross {
    fn check(&self, name: &str, expected: &Crossed, tolerance: &mut Tolerance) {
        let own = Belief::independent(pose(self.x), covariance(&self.P));
        let leader = cross::Leader {
            pose: pose(self.leader_x),
            covariance: covariance(&self.leader_P),
        };
        let said = datum(self.y_star, &self.R_ind, &self.R_ind);
        let before = matrix(&self.C) * matrix(&self.Phi).transpose();
        let gate = self.gate.unwrap_or(f64::INFINITY);
        let found = cross::update(&own, &before, &leader, &said, gate);
        let stated = Updated {
            accepted: expected.accepted,
            d2: expected.d2,
            x: expected.x,
            P: expected.P,
        };
        stated.check(name, &found.update, tolerance);
        let of = (sigma(&expected.P), sigma(&self.leader_P));
        let name = format!("{name}: C");
        tolerance.matrix(&name, &found.with_this(&before), &expected.C, of);
    }
}

#[test]
fn updates() {
    let Some(file) = read_vectors::<File>("leader/updates.json") else {
        return;
    };
    assert!(file.cases.len() > 50, "{}", file.cases.len());
    let mut tolerances = [tolerance(1e-9), tolerance(1e-6)];
    for Case { id, tag, tol, kind } in &file.cases {
        let name = format!("{id} ({tag})");
        let it = &mut tolerances[usize::from(tol.is_some_and(|tol| tol > 1e-9))];
        match kind {
            Kind::Position { input, expected } => expected.check(&name, &input.position(), it),
            Kind::Heading { input, expected } => expected.check(&name, &input.heading(), it),
            Kind::Pose { input, expected } => expected.check(&name, &input.pose(), it),
            Kind::Child { input, expected } => input.check(&name, expected, it),
            Kind::Cross { input, expected } => input.check(&name, expected, it),
        }
    }
    tolerances[0].report("updates.json");
    tolerances[1].report("updates.json, split");
}

/// What a leader can know of nothing new moves nobody: a datum that is the child's own belief.
#[test]
fn nothing_is_learnt_of_what_is_known() {
    let P = covariance(&[[0.04, 0.01, 0.0], [0.01, 0.09, 0.002], [0.0, 0.002, 0.01]]);
    let own = Belief::independent(pose([1.0, 2.0, 0.3]), P);
    let leader = cross::Leader {
        pose: own.pose,
        covariance: P,
    };
    let noise = covariance(&[[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.001]]);
    let said = GlobalPose {
        pose: pose([1.2, 1.9, 0.25]),
        parts: Parts::independent(noise),
    };
    let at_leader = GlobalPose {
        pose: own.pose,
        ..said
    };
    let found = cross::update(&own, &P.matrix(), &leader, &at_leader, f64::INFINITY);
    let change = found.update.belief.total().matrix() - P.matrix();
    assert!(found.update.accepted && change.abs().max() < 1e-15);
    assert!((found.left - nalgebra::Matrix3::identity()).abs().max() < 1e-12);
}

/// Of a leader that nothing is shared with, the datum is news.
#[test]
fn without_correlation_it_is_a_kalman_update() {
    let P = covariance(&[[0.04, 0.01, 0.0], [0.01, 0.09, 0.002], [0.0, 0.002, 0.01]]);
    let own = Belief::independent(pose([1.0, 2.0, 0.3]), P);
    let at = Belief::independent(
        pose([0.0, 1.0, 0.1]),
        covariance(&[[0.01, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 1e-8]]),
    );
    let reading = coloc_estimator::assist::datum::Reading {
        relative: pose([1.1, 0.9, 0.2]),
        covariance: covariance(&[[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.001]]),
    };
    let said = coloc_estimator::assist::datum::first(&at, &reading, Propagation::Paper);
    let leader = cross::Leader {
        pose: at.pose,
        covariance: at.total(),
    };
    let none = nalgebra::Matrix3::zeros();
    let crossed = cross::update(&own, &none, &leader, &said, f64::INFINITY).update;
    let plain = kalman::update(&own, &said.pose, &said.total(), f64::INFINITY);
    assert!((crossed.d2 - plain.d2).abs() < 1e-6 * plain.d2);
    let difference = crossed.belief.total().matrix() - plain.belief.total().matrix();
    assert!(difference.abs().max() < 1e-8, "{difference}");
}

/// What no two errors can have in common, and what is no number, moves nobody.
#[test]
fn an_impossible_correlation_is_refused() {
    let P = covariance(&[[0.04, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, 0.01]]);
    let own = Belief::independent(pose([1.0, 2.0, 0.3]), P);
    let leader = cross::Leader {
        pose: own.pose,
        covariance: P,
    };
    let said = GlobalPose {
        pose: pose([1.1, 2.0, 0.3]),
        parts: Parts::independent(P),
    };
    for factor in [5.0, f64::NAN, f64::INFINITY] {
        let C = P.matrix() * factor;
        let found = cross::update(&own, &C, &leader, &said, f64::INFINITY);
        assert!(!found.update.accepted, "{factor}");
        assert_eq!(found.update.belief, own);
        assert_eq!(found.with_other(&P.matrix()), P.matrix());
    }
}
