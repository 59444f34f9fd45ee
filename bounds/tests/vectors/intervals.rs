//! `intervals.json`

use coloc_bounds::heading::{Link, tree};
use coloc_bounds::{AngleInterval, RangeInterval, wrap};
use serde::Deserialize;

use crate::case::{Worst, read_vectors};

const TOLERANCE: f64 = 1e-12;

#[derive(Deserialize)]
struct Case {
    id: String,
    #[serde(flatten)]
    what: What,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum What {
    Intersect {
        input: Pair,
        expected: Option<[f64; 2]>,
    },
    Additive {
        input: Additive,
        expected: [f64; 2],
    },
    Multiplicative {
        input: Multiplicative,
        expected: [f64; 2],
    },
    HeadingTree {
        input: Tree,
        expected: Vec<(usize, Option<f64>, Option<f64>)>,
        truth: Option<Vec<f64>>,
    },
}

#[derive(Deserialize)]
struct Pair {
    a: [f64; 2],
    b: [f64; 2],
}

#[derive(Deserialize)]
struct Additive {
    r: f64,
    e: f64,
}

#[derive(Deserialize)]
struct Multiplicative {
    r: f64,
    rho: f64,
}

#[derive(Deserialize)]
struct Tree {
    n: usize,
    sources: Vec<(usize, f64, f64)>,
    edges: Vec<Edge>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Edge {
    Mutual(String, usize, usize, f64, f64, f64, f64),
    Relative(String, usize, usize, f64, f64),
}

impl Edge {
    fn link(&self) -> Link {
        match self {
            Self::Mutual(kind, i, j, phi_ij, half_ij, phi_ji, half_ji) => {
                assert_eq!(kind, "mutual");
                let i_sees = AngleInterval::new(*phi_ij, *half_ij);
                Link::mutual(i - 1, j - 1, i_sees, AngleInterval::new(*phi_ji, *half_ji))
            }
            Self::Relative(kind, i, j, turn, half) => {
                assert_eq!(kind, "relative");
                Link {
                    from: i - 1,
                    to: j - 1,
                    turn: AngleInterval::new(*turn, *half),
                }
            }
        }
    }
}

fn compare(worst: &mut Worst, name: &str, found: AngleInterval, expected: [f64; 2]) {
    worst.take(name, wrap(found.centre - expected[0]).abs());
    worst.take(name, (found.half - expected[1]).abs());
}

fn check_tree(
    worst: &mut Worst,
    name: &str,
    input: &Tree,
    expected: &[(usize, Option<f64>, Option<f64>)],
) {
    let sources = input.sources.iter();
    let sources: Vec<_> = sources
        .map(|&(robot, centre, half)| (robot - 1, AngleInterval::new(centre, half)))
        .collect();
    let links: Vec<_> = input.edges.iter().map(Edge::link).collect();
    let found = tree(input.n, &sources, &links);
    assert_eq!(found.len(), expected.len());
    for &(robot, centre, half) in expected {
        let of_robot = found[robot - 1];
        assert_eq!(
            of_robot.is_some(),
            centre.is_some(),
            "{name}: robot {robot}"
        );
        if let (Some(of_robot), Some(centre), Some(half)) = (of_robot, centre, half) {
            compare(worst, name, of_robot, [centre, half]);
        }
    }
}

#[test]
fn intervals_and_heading_trees() {
    let mut worst = Worst::new("intervals and heading trees", TOLERANCE);
    for Case { id, what } in read_vectors::<Case>("intervals.json") {
        match what {
            What::Intersect {
                input: Pair { a, b },
                expected,
            } => {
                let [a, b] = [a, b].map(|[centre, half]| AngleInterval::new(centre, half));
                let found = a.intersect(&b);
                assert_eq!(found.is_some(), expected.is_some(), "{id}");
                if let (Some(found), Some(expected)) = (found, expected) {
                    compare(&mut worst, &id, found, expected);
                }
            }
            What::Additive {
                input: Additive { r, e },
                expected: [least, most],
            } => {
                let found = RangeInterval::additive(r, e);
                worst.take(
                    &id,
                    (found.least - least).abs().max((found.most - most).abs()),
                );
            }
            What::Multiplicative {
                input: Multiplicative { r, rho },
                expected: [least, most],
            } => {
                let found = RangeInterval::multiplicative(r, rho);
                worst.take(
                    &id,
                    (found.least - least).abs().max((found.most - most).abs()),
                );
            }
            What::HeadingTree {
                input,
                expected,
                truth,
            } => {
                check_tree(&mut worst, &id, &input, &expected);
                for (robot, truth) in truth.into_iter().flatten().enumerate() {
                    if let (_, Some(centre), Some(half)) = expected[robot] {
                        let inside = AngleInterval::new(centre, half).contains(truth, TOLERANCE);
                        assert!(inside, "{id}: robot {robot}");
                    }
                }
            }
        }
    }
}
