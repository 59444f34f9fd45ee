//! What four searches and each further one bring.

use coloc_bounds::polygon::area;
use coloc_bounds::{Sandwich, Tolerance};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::support_of;

const TOLERANCE: Tolerance = Tolerance {
    shortest: 1e-9,
    triangle: 1e-12,
    edge: 1e-9,
};

/// The ratio after `k` searches is no less, whatever the set.
const GUARANTEED: [(usize, f64); 19] = [
    (4, 0.5),
    (5, 0.5701),
    (6, 0.6545),
    (7, 0.75),
    (8, 0.8535),
    (9, 0.8665),
    (10, 0.8797),
    (11, 0.8931),
    (12, 0.9065),
    (13, 0.9202),
    (14, 0.9339),
    (15, 0.9478),
    (16, 0.9619),
    (20, 0.9690),
    (24, 0.9761),
    (28, 0.9832),
    (30, 0.9868),
    (32, 0.9903),
    (40, 0.9921),
];

/// Convex, counter-clockwise: points of an ellipse, at angles of their own.
fn polygon(random: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let count = random.random_range(3..40);
    let flat = random.random_range(0.05..1.0);
    let mut angles: Vec<f64> = (0..count)
        .map(|_| random.random_range(0.0..core::f64::consts::TAU))
        .collect();
    angles.sort_by(f64::total_cmp);
    let turn = random.random_range(0.0..3.0_f64);
    let points = angles.iter().map(|it| {
        let (x, y) = (it.cos(), flat * it.sin());
        [
            x * turn.cos() - y * turn.sin(),
            x * turn.sin() + y * turn.cos(),
        ]
    });
    points.collect()
}

/// How large the gap can be after `k` searches, as a part of that after four.
#[allow(clippy::cast_precision_loss)] // Small numbers.
fn largest_gap(k: usize) -> f64 {
    let stage = (k / 4).ilog2();
    let begun = 4 * 2_usize.pow(stage);
    let done = (k - begun) as f64 / begun as f64;
    0.25_f64.powi(i32::try_from(stage).unwrap()) * (1.0 - 0.75 * done)
}

#[test]
fn polygons_are_approached_as_fast_as_is_proven() {
    for seed in 0..500 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let vertices = polygon(&mut random);
        let size = area(&vertices);
        if size < 1e-4 {
            continue;
        }
        let angle = random.random_range(0.0..core::f64::consts::TAU);
        let mut search = |direction| Some(support_of(&vertices, direction));
        let first = [angle.cos(), angle.sin()];
        let mut found = Sandwich::start(&mut search, first, TOLERANCE).unwrap();
        let gap = found.gap();
        assert!(
            (found.outer_area() / found.inner_area() - 2.0).abs() < 1e-9,
            "{seed}"
        );
        let (mut inner, mut outer) = (found.inner_area(), found.outer_area());
        loop {
            let k = found.searches();
            let name = format!("polygon {seed}, search {k}");
            assert!(found.inner_area() >= inner - 1e-12, "{name}: inner");
            assert!(found.outer_area() <= outer + 1e-12, "{name}: outer");
            (inner, outer) = (found.inner_area(), found.outer_area());
            assert!(inner <= size + 1e-12 && outer >= size - 1e-12, "{name}");
            assert!(found.gap() <= gap * largest_gap(k) + 1e-12, "{name}: gap");
            if let Some((_, least)) = GUARANTEED.iter().find(|it| it.0 == k) {
                assert!(
                    found.ratio() >= least - 1e-4,
                    "{name}: ratio {}",
                    found.ratio()
                );
            }
            if k > 60 || !found.refine(&mut search) {
                break;
            }
            let most = outer - inner;
            assert!(found.gap() <= most + 1e-12, "{name}");
        }
        assert!(found.searches() <= 2 * vertices.len() + 2, "{seed}");
        assert!(vertices.iter().all(|it| found.sides().iter().all(|side| {
            let at = side.direction[0] * it[0] + side.direction[1] * it[1];
            at <= side.found.safe + 1e-12
        })));
    }
}

#[test]
fn a_search_that_fails_costs_its_triangle_alone() {
    let vertices: Vec<[f64; 2]> = (0..24)
        .map(|k| f64::from(k) * core::f64::consts::TAU / 24.0)
        .map(|it| [it.cos(), it.sin()])
        .collect();
    let mut count = 0;
    let mut search = |direction| {
        count += 1;
        (count != 6).then(|| support_of(&vertices, direction))
    };
    let mut found = Sandwich::start(&mut search, [0.8, 0.6], TOLERANCE).unwrap();
    while found.searches() < 60 && found.refine(&mut search) {}
    assert!(found.searches() < 60, "it goes on for ever");
    let whole = area(&vertices);
    assert!(found.outer_area() >= whole && found.outer_area() < 1.2 * whole);
}
