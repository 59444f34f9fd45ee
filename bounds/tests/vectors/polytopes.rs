//! `polytopes.json`

use coloc_bounds::polygon::area;
use coloc_bounds::simplex::NoVertex;
use coloc_bounds::{
    Arena, Gauge, Limits, Polytope, Projection, Region, Sandwich, Shape, Source, Tolerance,
};
use serde::Deserialize;

use crate::case::{End, Measured, Worst, read_vectors};

#[derive(Deserialize)]
pub(crate) struct Network {
    pub(crate) id: String,
    pub(crate) n: usize,
    pub(crate) gauge: Vec<(usize, char, f64)>,
    pub(crate) measurements: Vec<Measured>,
}

#[derive(Deserialize)]
pub(crate) struct Case {
    #[serde(flatten)]
    pub(crate) network: Network,
    status: String,
    min_relaxation: Option<f64>,
    #[serde(default)]
    projections: Vec<Expected>,
    truth: Option<Vec<[f64; 2]>>,
}

#[derive(Deserialize)]
struct Expected {
    projection: Shadow,
    kind: String,
    supports: Vec<Option<f64>>,
    area: Option<f64>,
    centroid: Option<[f64; 2]>,
    #[serde(default)]
    vertices: Vec<[f64; 2]>,
}

#[derive(Copy, Clone, Deserialize)]
#[serde(untagged)]
pub(crate) enum Shadow {
    Robot(usize),
    Difference(usize, usize),
}

impl Shadow {
    pub(crate) fn projection(self) -> Projection {
        match self {
            Self::Robot(i) => Projection::Robot(i - 1),
            Self::Difference(i, j) => Projection::Difference(i - 1, j - 1),
        }
    }
}

impl Network {
    /// All of it, around what is known of places.
    pub(crate) fn polytope(&self, slack_m: f64) -> Polytope {
        let gauge = self.gauge.iter();
        let gauge: Vec<_> = gauge
            .map(|&(robot, axis, value)| Gauge {
                robot: robot - 1,
                axis: usize::from(axis == 'y'),
                value,
            })
            .collect();
        let mut polytope = Polytope::new(self.n, &gauge, self.arena(), slack_m).unwrap();
        for (index, measured) in self.measurements.iter().enumerate() {
            let measurement = measured.measurement();
            polytope
                .add(&measurement, Source::Measurement(index))
                .unwrap();
        }
        polytope
    }

    fn arena(&self) -> Arena {
        let places: Vec<[f64; 2]> = self.measurements.iter().filter_map(place).collect();
        #[allow(clippy::cast_precision_loss)] // A handful.
        let count = places.len().max(1) as f64;
        let sum = |axis: usize| places.iter().map(|it| it[axis]).sum::<f64>();
        Arena {
            centre: [sum(0) / count, sum(1) / count],
            half: 1e3,
        }
    }
}

fn place(measured: &Measured) -> Option<[f64; 2]> {
    match *measured {
        Measured::AbsoluteBox { p, .. } => Some(p),
        Measured::Bearing {
            i: End::Landmark { at },
            ..
        }
        | Measured::Bearing {
            j: End::Landmark { at },
            ..
        }
        | Measured::RangeMax {
            i: End::Landmark { at },
            ..
        } => Some(at),
        _ => None,
    }
}

struct Deviations {
    slack_m: f64,
    supports: Worst,
    safe: Worst,
    areas: Worst,
    centroids: Worst,
    relaxations: Worst,
}

impl Deviations {
    /// As the README of the vectors allows, without slack and with.
    fn new(slack_m: f64) -> Self {
        let of_supports = if slack_m > 0.0 { 1e-7 } else { 1e-9 };
        Self {
            slack_m,
            supports: Worst::new("supports", of_supports),
            safe: Worst::new("supports, safe_upper below by", 0.0),
            areas: Worst::new("areas", 1e-6),
            centroids: Worst::new("centroids", 1e-7),
            relaxations: Worst::new("min_relaxation", 1e-7),
        }
    }

    fn check(&mut self, case: &Case) {
        let id = &case.network.id;
        let polytope = case.network.polytope(self.slack_m);
        match polytope.region() {
            Ok(mut region) => {
                assert_eq!(case.status, "feasible", "{id}");
                for expected in &case.projections {
                    self.check_shadow(id, &mut region, expected, case.truth.as_deref());
                }
            }
            Err(NoVertex::Infeasible(conflict)) => {
                assert_eq!(case.status, "infeasible", "{id}");
                let expected = case.min_relaxation.unwrap();
                self.relaxations
                    .take(id, (conflict.relaxation + self.slack_m - expected).abs());
                assert!(!polytope.sources(&conflict).is_empty(), "{id}");
            }
            Err(NoVertex::Failed) => panic!("{id}: failed"),
        }
    }

    fn check_shadow(
        &mut self,
        id: &str,
        region: &mut Region,
        expected: &Expected,
        truth: Option<&[[f64; 2]]>,
    ) {
        let projection = expected.projection.projection();
        let count = expected.supports.len();
        #[allow(clippy::cast_precision_loss)] // Sixteen.
        for (k, support) in expected.supports.iter().enumerate() {
            let psi = core::f64::consts::TAU * k as f64 / count as f64;
            let found = region.support(projection, [psi.cos(), psi.sin()]).unwrap();
            assert_eq!(
                found.unbounded,
                support.is_none(),
                "{id} {projection:?} {k}"
            );
            let Some(support) = *support else { continue };
            let above = (found.value - support) / (1.0 + support.abs());
            if self.slack_m > 0.0 {
                assert!(
                    above > -1e-10,
                    "{id} {projection:?} {k}: below by {above:e}"
                );
            }
            self.supports
                .take(format!("{id} {projection:?} {k}"), above.abs());
            // The file's number is itself rounded.
            let below = support - support.abs() * f64::EPSILON - found.safe;
            self.safe
                .take(format!("{id} {projection:?} {k}"), below.max(0.0));
        }
        let at = truth.map(|truth| match projection {
            Projection::Robot(i) => truth[i],
            Projection::Difference(i, j) => [truth[i][0] - truth[j][0], truth[i][1] - truth[j][1]],
        });
        let tolerance = Tolerance::of_programs(&Arena {
            centre: [0.0; 2],
            half: 1e3,
        });
        let limits = Limits {
            ratio: 1.0,
            gap: 0.0,
            searches: 200,
        };
        let mut search = |direction| region.support(projection, direction);
        let first = [0.955_336_489_125_606, 0.295_520_206_661_339_55];
        let found = Sandwich::approximate(&mut search, first, tolerance, limits).unwrap();
        let inside = at.is_none_or(|it| found.may_hold(it) || found.shape() == Shape::Unbounded);
        assert!(inside, "{id} {projection:?}: the truth is outside");
        self.check_shape(&format!("{id} {projection:?}"), &found, expected);
    }

    fn check_shape(&mut self, name: &str, found: &Sandwich, expected: &Expected) {
        let kind = match found.shape() {
            Shape::Polygon => "polygon",
            Shape::Segment(_) => "segment",
            Shape::Point(_) => "point",
            Shape::Unbounded => "unbounded",
        };
        assert_eq!(kind, expected.kind, "{name}");
        if let (Shape::Polygon, Some(exact)) = (found.shape(), expected.area) {
            let searches = found.searches();
            let vertices = expected.vertices.len();
            if self.slack_m <= 0.0 {
                assert!(
                    searches <= 2 * vertices,
                    "{name}: {searches} searches, {vertices} vertices"
                );
                self.areas
                    .take(name, (area(&found.outer()) / exact - 1.0).abs());
                self.areas
                    .take(name, (area(&found.inner()) / exact - 1.0).abs());
            } else {
                self.areas
                    .take(name, (area(&found.outer()) / exact - 1.0).abs());
            }
        }
        if let (Some(exact), Some(found)) = (expected.centroid, found.centroid()) {
            self.centroids
                .take(name, (found[0] - exact[0]).hypot(found[1] - exact[1]));
        }
    }
}

fn run(slack_m: f64) {
    let mut deviations = Deviations::new(slack_m);
    for case in read_vectors::<Case>("polytopes.json") {
        deviations.check(&case);
    }
}

#[test]
fn shadows_without_slack() {
    run(0.0);
}

#[test]
fn shadows_with_slack() {
    run(1e-9);
}
