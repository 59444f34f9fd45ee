//! A pose and what is seen from it, once and in chains, in both orders.

use coloc_estimator::assist::datum::{Reading, carried, extend, first, joined};
use coloc_estimator::{Belief, Covariance3, GlobalPose, Propagation};
use serde::Deserialize;

use crate::case::{Rows, Seen, Tolerance, covariance, pose, sigma};
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
    Pair { input: Pair, expected: Moments },
    Chain { input: Chain, expected: Orders },
}

#[derive(Deserialize)]
struct Pair {
    a: [f64; 3],
    A: Rows,
    b: [f64; 3],
    B: Rows,
}

#[derive(Deserialize)]
struct Moments {
    c: [f64; 3],
    C: Rows,
    exact_c: [f64; 3],
    exact_C: Rows,
}

#[derive(Deserialize)]
struct Chain {
    x: [f64; 3],
    P: Rows,
    links: Vec<Seen>,
}

#[derive(Deserialize)]
struct Orders {
    relative_first: Said,
    global_first: Said,
}

#[derive(Deserialize)]
struct Said {
    y_star: [f64; 3],
    R_star: Rows,
    R_ind: Rows,
}

fn tolerance() -> Tolerance {
    Tolerance::new(|value, _| 1e-9 * value.abs().max(1.0), (1e-8, 1e-18))
}

impl Pair {
    fn check(&self, name: &str, expected: &Moments, tolerance: &mut Tolerance) {
        let leader = Belief::independent(pose(self.a), covariance(&self.A));
        let reading = Seen {
            z: self.b,
            R: self.B,
        }
        .reading();
        for (propagation, mean, rows) in [
            (Propagation::Paper, expected.c, &expected.C),
            (Propagation::Honest, expected.exact_c, &expected.exact_C),
        ] {
            let found = first(&leader, &reading, propagation);
            let name = format!("{name}, {propagation:?}");
            let of = sigma(rows);
            tolerance.pose(&name, &found.pose, mean, of);
            tolerance.matrix(&name, &found.total().matrix(), rows, (of, of));
        }
    }
}

impl Chain {
    /// Chapter 4.
    fn global_first(&self) -> GlobalPose {
        let leader = Belief::independent(pose(self.x), covariance(&self.P));
        let (near, rest) = self.links.split_first().unwrap();
        let start = first(&leader, &near.reading(), Propagation::Paper);
        rest.iter().fold(start, |said, link| {
            extend(&said, &link.reading(), Propagation::Paper)
        })
    }

    /// Chapter 3.
    fn relative_first(&self) -> GlobalPose {
        let leader = Belief::independent(pose(self.x), covariance(&self.P));
        let links = self.links.iter().map(Seen::reading);
        let all = links
            .reduce(|near, far| joined(&near, &far, Propagation::Paper))
            .unwrap();
        first(&leader, &all, Propagation::Paper)
    }
}

impl Said {
    fn check(&self, name: &str, found: &GlobalPose, tolerance: &mut Tolerance) {
        let of = sigma(&self.R_star);
        tolerance.pose(name, &found.pose, self.y_star, of);
        tolerance.matrix(
            &format!("{name}: R*"),
            &found.total().matrix(),
            &self.R_star,
            (of, of),
        );
        let independent = found.parts.independent.matrix();
        let name = format!("{name}: R_ind");
        tolerance.matrix(&name, &independent, &self.R_ind, (of, of));
    }
}

#[test]
fn composition() {
    let Some(file) = read_vectors::<File>("leader/composition.json") else {
        return;
    };
    assert!(file.cases.len() > 40, "{}", file.cases.len());
    let mut tolerance = tolerance();
    for Case { id, tag, kind } in &file.cases {
        let name = format!("{id} ({tag})");
        match kind {
            Kind::Pair { input, expected } => input.check(&name, expected, &mut tolerance),
            Kind::Chain { input, expected } => {
                let Orders {
                    relative_first,
                    global_first,
                } = expected;
                global_first.check(&name, &input.global_first(), &mut tolerance);
                relative_first.check(&name, &input.relative_first(), &mut tolerance);
            }
        }
    }
    tolerance.report("composition.json");
}

/// A relay's own way is noise, and none of it news.
#[test]
fn a_way_adds_nothing_that_is_independent() {
    let covariance = |scale: f64| {
        covariance(&[
            [0.04 * scale, 0.01 * scale, 0.0],
            [0.01 * scale, 0.09 * scale, 0.002 * scale],
            [0.0, 0.002 * scale, 0.01 * scale],
        ])
    };
    let leader = Belief::independent(pose([1.0, 2.0, 0.7]), covariance(0.1));
    let seen = Reading {
        relative: pose([2.0, -0.5, 1.1]),
        covariance: covariance(0.2),
    };
    let way = Reading {
        relative: pose([0.3, 0.01, -0.2]),
        covariance: covariance(0.05),
    };
    let exact = Reading {
        covariance: Covariance3::ZERO,
        ..way
    };
    for propagation in [Propagation::Paper, Propagation::Honest] {
        let said = first(&leader, &seen, propagation);
        let found = carried(&said, &way, propagation);
        let (whole, alone) = (
            extend(&said, &way, propagation),
            extend(&said, &exact, propagation),
        );
        assert_eq!(found.pose, alone.pose);
        assert_eq!(found.parts.independent, alone.parts.independent);
        let difference = found.total().matrix() - whole.total().matrix();
        // An uncertain heading spreads the noise of the way a little more.
        assert!(
            difference.abs().max() < 2e-5,
            "{propagation:?}: {difference}"
        );
        let added = found.total().matrix() - alone.total().matrix();
        assert!(added.trace() > 0.005, "{added}");
    }
}
