//! `diagnosis.json`

use coloc_bounds::diagnosis::{elastic, joint_residual, membership, removable};
use coloc_bounds::simplex::NoVertex;
use coloc_bounds::{Polytope, Source};
use serde::Deserialize;

use crate::case::{Worst, read_vectors};
use crate::polytopes::Network;

#[derive(Deserialize)]
struct Case {
    #[serde(flatten)]
    network: Network,
    min_relaxation: Option<f64>,
    elastic_total: Option<f64>,
    #[serde(default)]
    slack_range: Vec<[f64; 2]>,
    suspect: Option<usize>,
    #[serde(default)]
    removable: Vec<usize>,
    #[serde(default)]
    mu: Vec<[f64; 2]>,
    #[serde(default)]
    membership: Vec<(usize, f64)>,
    joint_residual: Option<f64>,
    joint_residual_of: Option<usize>,
}

struct Deviations {
    slack_m: f64,
    relaxations: Worst,
    totals: Worst,
    slacks: Worst,
    distances: Worst,
    residuals: Worst,
}

impl Deviations {
    fn check_conflict(&mut self, case: &Case, polytope: &Polytope) {
        let id = &case.network.id;
        let Err(NoVertex::Infeasible(conflict)) = polytope.region() else {
            panic!("{id}: no conflict");
        };
        let exact = case.min_relaxation.unwrap();
        self.relaxations
            .take(id, (conflict.relaxation - exact).abs());
        let found = elastic(polytope).unwrap();
        self.totals
            .take(id, (found.total - case.elastic_total.unwrap()).abs());
        for (&(source, slack), &[least, most]) in found.slacks.iter().zip(&case.slack_range) {
            let off = (least - slack).max(slack - most).max(0.0);
            self.slacks.take(format!("{id} {source:?}"), off);
        }
        if let Some(suspect) = case.suspect {
            assert_eq!(found.suspect(), Some(Source::Measurement(suspect)), "{id}");
        }
        let expected: Vec<_> = case
            .removable
            .iter()
            .map(|&it| Source::Measurement(it))
            .collect();
        assert_eq!(removable(polytope, &conflict).unwrap(), expected, "{id}");
    }

    fn check_estimates(&mut self, case: &Case, polytope: &Polytope) {
        let id = &case.network.id;
        for &(robot, exact) in &case.membership {
            let found = membership(polytope, robot - 1, case.mu[robot - 1]).unwrap();
            self.distances
                .take(format!("{id}, robot {robot}"), (found.metres - exact).abs());
            assert!(found.at_least <= exact, "{id}, robot {robot}");
            let proven = found.at_least > 0.0;
            assert_eq!(proven, exact > 1e-7, "{id}, robot {robot}");
        }
        let (found, source) = joint_residual(polytope, &case.mu).unwrap();
        self.residuals
            .take(id, (found - case.joint_residual.unwrap()).abs());
        let expected = case.joint_residual_of.unwrap();
        assert_eq!(source, Source::Measurement(expected), "{id}");
    }
}

fn run(slack_m: f64) {
    let mut deviations = Deviations {
        slack_m,
        relaxations: Worst::new("min_relaxation", 1e-7),
        totals: Worst::new("elastic_total", 1e-7),
        slacks: Worst::new("slacks outside of their range", 1e-6),
        distances: Worst::new("membership", 1e-7),
        residuals: Worst::new("joint_residual", 1e-7),
    };
    for case in read_vectors::<Case>("diagnosis.json") {
        let polytope = case.network.polytope(deviations.slack_m);
        if case.mu.is_empty() {
            deviations.check_conflict(&case, &polytope);
        } else {
            deviations.check_estimates(&case, &polytope);
        }
    }
}

#[test]
fn conflicts_and_distances_without_slack() {
    run(0.0);
}

#[test]
fn conflicts_and_distances_with_slack() {
    run(1e-9);
}
