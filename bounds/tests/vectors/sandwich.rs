//! `sandwich.json`

use coloc_bounds::{Arena, Limits, Polytope, Sandwich, Shape, Support, Tolerance};
use serde::Deserialize;

use crate::case::{Worst, read_vectors};
use crate::polytopes::{self, Network, Shadow};

#[derive(Deserialize)]
struct Case {
    id: String,
    shape: Option<Form>,
    network: Option<(String, Shadow)>,
    d1: [f64; 2],
    expected: Expected,
    centroid: Option<[f64; 2]>,
    #[serde(default)]
    uniform: Vec<(usize, f64, f64)>,
    affine_of: Option<String>,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Form {
    Disc { center: [f64; 2], radius: f64 },
    Polygon { vertices: Vec<[f64; 2]> },
}

#[derive(Deserialize)]
struct Expected {
    status: String,
    #[serde(default)]
    log: Vec<(usize, f64, f64)>,
    compare_until: Option<usize>,
    #[serde(default)]
    exhausted: bool,
    searches_to_095: Option<usize>,
    #[serde(default)]
    optimum_not_unique_in_first_four: bool,
    #[serde(default)]
    ends: Vec<[f64; 2]>,
    searches: Option<usize>,
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl Form {
    fn is_far(&self) -> bool {
        let size = self.support([1.0, 0.0]).point;
        size[0].hypot(size[1]) > 1e3
    }

    fn support(&self, direction: [f64; 2]) -> Support {
        let point = match self {
            Self::Disc { center, radius } => [
                center[0] + radius * direction[0],
                center[1] + radius * direction[1],
            ],
            Self::Polygon { vertices } => {
                let further = |a: [f64; 2], b: [f64; 2]| {
                    if dot(b, direction) > dot(a, direction) {
                        b
                    } else {
                        a
                    }
                };
                vertices.iter().copied().reduce(further).unwrap()
            }
        };
        let value = dot(point, direction);
        Support {
            point,
            value,
            safe: value,
            unbounded: false,
        }
    }
}

struct Deviations {
    areas: Worst,
    uniform: Worst,
    centroids: Worst,
    ends: Worst,
    affine: Worst,
}

impl Deviations {
    fn new(of_areas: f64) -> Self {
        Self {
            areas: Worst::new("sandwich areas, of outer", of_areas),
            uniform: Worst::new("uniform areas, of outer", of_areas),
            centroids: Worst::new("sandwich centroids", 1e-7),
            ends: Worst::new("ends of segments and points", 1e-6),
            affine: Worst::new("ratios of affine pairs", 1e-9),
        }
    }

    fn check(
        &mut self,
        case: &Case,
        search: &mut impl FnMut([f64; 2]) -> Option<Support>,
        tolerance: Tolerance,
        is_shape: bool,
    ) {
        let (id, expected) = (&case.id, &case.expected);
        let mut found = Sandwich::start(search, case.d1, tolerance).unwrap();
        if expected.status == "polygon" {
            let ambiguous = expected.optimum_not_unique_in_first_four && !is_shape;
            self.check_log(case, search, &mut found, ambiguous);
        } else {
            self.check_ends(id, &found, expected);
        }
        for &(count, inner, outer) in &case.uniform {
            let uniform = Sandwich::uniform(search, count, tolerance).unwrap();
            let name = format!("{id}, {count} directions");
            self.uniform
                .take(&name, (uniform.outer_area() - outer).abs() / outer);
            // Where an edge of the set is searched, any point of it is right.
            if is_shape {
                self.uniform
                    .take(&name, (uniform.inner_area() - inner).abs() / outer);
            }
        }
    }

    fn check_log(
        &mut self,
        case: &Case,
        search: &mut impl FnMut([f64; 2]) -> Option<Support>,
        found: &mut Sandwich,
        ambiguous: bool,
    ) {
        let (id, expected) = (&case.id, &case.expected);
        let until = expected.compare_until.unwrap();
        let mut to_095 = None;
        for &(k, inner, outer) in &expected.log {
            if k > 4 && !found.refine(search) {
                assert!(k > until || ambiguous, "{id}: no search {k}");
                break;
            }
            assert_eq!(found.searches(), k, "{id}");
            if found.ratio() >= 0.95 && to_095.is_none() {
                to_095 = Some(k);
            }
            if k <= until && !ambiguous {
                let name = format!("{id}, search {k}");
                self.areas
                    .take(&name, (found.inner_area() - inner).abs() / outer);
                self.areas
                    .take(&name, (found.outer_area() - outer).abs() / outer);
            }
        }
        if !ambiguous && expected.searches_to_095.is_some_and(|it| it <= until) {
            assert_eq!(to_095, expected.searches_to_095, "{id}: searches to 0.95");
        }
        while found.searches() < 100 && found.refine(search) {}
        if expected.exhausted {
            let &(_, _, outer) = expected.log.last().unwrap();
            self.areas.take(
                format!("{id}, exact"),
                (found.outer_area() / outer - 1.0).abs(),
            );
            assert!(!found.refine(search), "{id}: not exact after 100 searches");
            if let Some(exact) = case.centroid {
                let at = found.centroid().unwrap();
                self.centroids
                    .take(id, (at[0] - exact[0]).hypot(at[1] - exact[1]));
            }
        }
    }

    fn check_ends(&mut self, id: &str, found: &Sandwich, expected: &Expected) {
        assert_eq!(Some(found.searches()), expected.searches, "{id}");
        let ends = match found.shape() {
            Shape::Segment([a, b]) => vec![a, b],
            Shape::Point(at) => vec![at],
            other => panic!("{id}: {other:?}"),
        };
        let is = if ends.len() == 1 { "point" } else { "segment" };
        assert_eq!(expected.status, is, "{id}");
        assert!(found.ratio() >= 1.0 && found.gap() <= 0.0, "{id}");
        for end in ends {
            let distances = expected
                .ends
                .iter()
                .map(|it| (it[0] - end[0]).hypot(it[1] - end[1]));
            self.ends.take(id, distances.fold(f64::INFINITY, f64::min));
        }
    }

    fn check_affine(&mut self, case: &Case, other: &Case) {
        let ratios = |it: &Case| {
            let tolerance = of_shapes();
            let mut search = |direction| Some(it.shape.as_ref().unwrap().support(direction));
            let mut found = Sandwich::start(&mut search, it.d1, tolerance).unwrap();
            let until = it.expected.compare_until.unwrap();
            let ratios = (5..=until).map(|_| {
                found.refine(&mut search);
                found.ratio()
            });
            ratios.collect::<Vec<_>>()
        };
        for (a, b) in ratios(case).into_iter().zip(ratios(other)) {
            self.affine.take(&case.id, (a - b).abs());
        }
    }
}

fn of_shapes() -> Tolerance {
    Tolerance {
        shortest: 1e-6,
        triangle: 1e-12,
        edge: 1e-9,
    }
}

#[test]
fn shapes() {
    let cases = read_vectors::<Case>("sandwich.json");
    let mut near = Deviations::new(1e-9);
    // Areas in the file were summed about the origin: 1e4 m away from it they are off by 4e-8 themselves.
    let mut far = Deviations::new(1e-6);
    for case in &cases {
        let Some(shape) = &case.shape else { continue };
        let mut search = |direction| Some(shape.support(direction));
        let deviations = if shape.is_far() { &mut far } else { &mut near };
        deviations.check(case, &mut search, of_shapes(), true);
        if let Some(other) = &case.affine_of {
            let other = cases.iter().find(|it| it.id == *other).unwrap();
            deviations.check_affine(case, other);
        }
    }
}

fn networks(slack_m: f64) {
    let networks = read_vectors::<polytopes::Case>("polytopes.json");
    let mut deviations = Deviations::new(1e-6);
    for case in read_vectors::<Case>("sandwich.json") {
        let Some((id, shadow)) = &case.network else {
            continue;
        };
        let of_id = |it: &&polytopes::Case| it.network.id == *id;
        let network: &Network = &networks.iter().find(of_id).unwrap().network;
        let polytope: Polytope = network.polytope(slack_m);
        let mut region = polytope.region().unwrap();
        let mut search = |direction| region.support(shadow.projection(), direction);
        let tolerance = Tolerance::of_programs(&Arena {
            centre: [0.0; 2],
            half: 1e3,
        });
        deviations.check(&case, &mut search, tolerance, false);
    }
}

#[test]
fn networks_without_slack() {
    networks(0.0);
}

#[test]
fn networks_with_slack() {
    networks(1e-9);
}

#[test]
fn the_ratio_of_a_disc_is_the_worst_there_is() {
    let disc = Form::Disc {
        center: [0.0; 2],
        radius: 1.0,
    };
    let mut search = |direction| Some(disc.support(direction));
    let limits = Limits {
        searches: 16,
        ratio: 1.0,
        gap: 0.0,
    };
    let found = Sandwich::approximate(&mut search, [1.0, 0.0], of_shapes(), limits).unwrap();
    let cosine = (core::f64::consts::PI / 16.0).cos();
    assert!((found.ratio() - cosine * cosine).abs() < 1e-12);
}
