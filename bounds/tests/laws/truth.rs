//! The truth is inside, always.

use coloc_bounds::{Arena, Limits, Projection, Sandwich, Shape, Tolerance};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::network::{Sort, any_sort, gauge, network, with};

const FIRST: [f64; 2] = [0.955_336_489_125_606, 0.295_520_206_661_339_55];

#[test]
fn the_truth_is_in_every_polygon_of_twelve_robots() {
    let (mut polygons, mut other) = (0, 0);
    for seed in 0..1000 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let sort = any_sort(&mut random);
        let network = network(&mut random, 12, sort);
        let mut region = network.polytope.region().unwrap();
        let tolerance = Tolerance::of_programs(&network.polytope.arena());
        for robot in [1, random.random_range(2..12)] {
            let projection = Projection::Robot(robot);
            let mut search = |direction| region.support(projection, direction);
            let limits = Limits::default();
            let found = Sandwich::approximate(&mut search, FIRST, tolerance, limits).unwrap();
            let inside = found.may_hold(network.truth[robot]);
            assert!(inside, "network {seed}, robot {robot}: {:?}", found.shape());
            let is_polygon = found.shape() == Shape::Polygon;
            (polygons, other) = (
                polygons + usize::from(is_polygon),
                other + usize::from(!is_polygon),
            );
        }
    }
    println!("{polygons} polygons, {other} segments");
    assert!(polygons > 1700 && other > 100);
}

#[test]
fn one_more_measurement_lets_no_shadow_grow() {
    for seed in 0..200 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let network = network(&mut random, 5, Sort::Relative);
        let (some, _) = network
            .measurements
            .split_at(network.measurements.len() * 2 / 3);
        let arena = Arena {
            centre: [0.0; 2],
            half: 1e3,
        };
        let frame = gauge(Sort::Relative, &network.truth);
        let empty = coloc_bounds::Polytope::new(5, &frame, arena, 0.0).unwrap();
        let fewer = with(&empty, some);
        let all = with(&empty, &network.measurements);
        for robot in 1..5 {
            let template = |of: &coloc_bounds::Polytope| {
                of.region()
                    .unwrap()
                    .template(Projection::Robot(robot), 16)
                    .unwrap()
            };
            for (fewer, all) in template(&fewer).into_iter().zip(template(&all)) {
                assert!(
                    all <= fewer + 1e-9,
                    "network {seed}, robot {robot}: {all} {fewer}"
                );
            }
        }
    }
}

#[test]
fn the_same_measurements_give_the_same_bits() {
    let template = || {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let network = network(&mut random, 8, Sort::Fixed);
        let mut region = network.polytope.region().unwrap();
        let found = region.template(Projection::Robot(7), 16).unwrap();
        found.into_iter().map(f64::to_bits).collect::<Vec<_>>()
    };
    assert_eq!(template(), template());
}

/// The experiment of the paper: bearings alone, ± 2°, twelve robots.
#[test]
fn greedy_searches_beat_uniform_ones() {
    let (mut greedy, mut uniform, mut count) = (0.0, 0.0, 0.0);
    for seed in 0..20 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let network = network(&mut random, 12, Sort::Bearings);
        let mut region = network.polytope.region().unwrap();
        let tolerance = Tolerance::of_programs(&network.polytope.arena());
        for robot in 2..12 {
            let projection = Projection::Robot(robot);
            let mut search = |direction| region.support(projection, direction);
            let limits = Limits {
                ratio: 1.0,
                gap: 0.0,
                searches: 9,
            };
            let found = Sandwich::approximate(&mut search, FIRST, tolerance, limits).unwrap();
            if found.shape() == Shape::Polygon {
                greedy += found.ratio();
                uniform += Sandwich::uniform(&mut search, 15, tolerance)
                    .unwrap()
                    .ratio();
                count += 1.0;
            }
        }
    }
    println!(
        "ratio: greedy, 9 searches {:.3}; uniform, 15 {:.3}",
        greedy / count,
        uniform / count
    );
    assert!(greedy / count >= 0.9 && uniform / count < 0.9);
}
