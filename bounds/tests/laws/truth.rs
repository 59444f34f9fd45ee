//! The truth is inside, always.

use core::f64::consts::FRAC_PI_2;

use coloc_bounds::simplex::FEASIBLE;
use coloc_bounds::{
    AngleInterval, Arena, Limits, Measurement, Place, Polytope, Projection, RangeInterval,
    Sandwich, Seen, Shape, Simplex, Source, Tolerance,
};
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
        let empty = Polytope::new(5, &frame, arena, 0.0).unwrap();
        let fewer = with(&empty, some);
        let all = with(&empty, &network.measurements);
        for robot in 1..5 {
            let template = |of: &Polytope| {
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

/// A sighting of a sort that is hard to compute with: exact, nearly exact, wider than a half circle, of no length, without an end.
fn hard(random: &mut ChaCha8Rng, from: Place, to: Place, [x, y]: [f64; 2]) -> Measurement {
    let half = [0.0, 1e-9, 1e-4, 0.1, 1.5, FRAC_PI_2, 1.6, 3.0][random.random_range(0..8)];
    let mut off = |bound: f64| random.random_range(-1.0..1.0) * 0.99 * bound;
    let bearing = AngleInterval::new(y.atan2(x) + off(half), half);
    let distance = x.hypot(y);
    let (low, high) = (off(0.5).abs(), off(0.5).abs());
    let range = match random.random_range(0..4) {
        0 => RangeInterval {
            least: distance,
            most: distance,
        },
        1 => RangeInterval {
            least: 0.0,
            most: f64::INFINITY,
        },
        2 => RangeInterval {
            least: (distance - low).max(0.0),
            most: distance + high,
        },
        _ => RangeInterval {
            least: 0.0,
            most: distance + 1e3,
        },
    };
    let seen = match random.random_range(0..4) {
        0 => Seen::Bearing(bearing),
        1 => Seen::RangeMax {
            most: distance + high,
            directions: 8,
        },
        _ => Seen::RangeBearing(bearing, range),
    };
    Measurement::Between { from, to, seen }
}

/// Every fourth measurement is there twice.
fn hard_network(random: &mut ChaCha8Rng, truth: &[[f64; 2]]) -> Polytope {
    let half = [1e2, 1e3, 1e4][random.random_range(0..3)];
    let arena = Arena {
        centre: [0.0; 2],
        half,
    };
    let mut polytope = Polytope::new(truth.len(), &[], arena, 1e-9).unwrap();
    for index in 0..random.random_range(1..30) {
        let [i, j] = [0, 1].map(|_| random.random_range(0..truth.len()));
        let landmark = [
            random.random_range(-5.0..5.0),
            random.random_range(-5.0..5.0),
        ];
        let (from, at) = if i == j {
            (Place::At(landmark), landmark)
        } else {
            (Place::Robot(i), truth[i])
        };
        let d = [truth[j][0] - at[0], truth[j][1] - at[1]];
        let measurement = hard(random, from, Place::Robot(j), d);
        for _ in 0..=usize::from(index % 4 == 0) {
            polytope
                .add(&measurement, Source::Measurement(index))
                .unwrap();
        }
    }
    polytope
}

/// The vertices that programs end at satisfy every row, but for what counts as rounding.
fn check_vertices(seed: u64, polytope: &Polytope, robots: usize) {
    let mut simplex = Simplex::start(polytope.program(|_| true)).unwrap();
    for robot in 0..robots {
        let objective = polytope.objective(Projection::Robot(robot), FIRST);
        if simplex.maximize(objective.terms().iter().copied()).is_err() {
            continue;
        }
        let z = simplex.vertex();
        for row in polytope.rows() {
            let left: f64 = row.terms().iter().map(|it| it.1 * z[it.0]).sum();
            let broken = (left - row.rhs) / (1.0 + row.rhs.abs());
            assert!(
                broken < FEASIBLE,
                "{seed}, robot {robot}: broken by {broken:e}"
            );
        }
    }
}

fn run_hard(seeds: std::ops::Range<u64>) {
    let (mut bounded, mut unbounded, mut failed) = (0, 0, 0);
    for seed in seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let robots = random.random_range(1..8);
        let truth: Vec<_> = (0..robots)
            .map(|_| [0, 1].map(|_| random.random_range(-5.0..5.0)))
            .collect();
        let polytope = hard_network(&mut random, &truth);
        let mut region = polytope
            .region()
            .unwrap_or_else(|it| panic!("{seed}: {it:?}"));
        check_vertices(seed, &polytope, robots);
        let tolerance = Tolerance::of_programs(&polytope.arena());
        for (robot, at) in truth.iter().enumerate() {
            let mut search = |direction| region.support(Projection::Robot(robot), direction);
            let limits = Limits::default();
            let Some(found) = Sandwich::approximate(&mut search, FIRST, tolerance, limits) else {
                failed += 1;
                continue;
            };
            assert!(
                found.may_hold(*at),
                "{seed}, robot {robot}: {:?}",
                found.shape()
            );
            let finite = found.inner().iter().flatten().all(|it| it.is_finite());
            assert!(finite, "{seed}, robot {robot}");
            assert!(
                (0.0..=1.0).contains(&found.ratio()),
                "{seed}: {}",
                found.ratio()
            );
            let is_open = found.shape() == Shape::Unbounded;
            (bounded, unbounded) = (
                bounded + usize::from(!is_open),
                unbounded + usize::from(is_open),
            );
        }
    }
    println!("{bounded} bounded, {unbounded} unbounded, {failed} failed");
    assert!(bounded > 100 && unbounded > 100);
    // Bearings to 1e-9 rad are more than double precision can always invert. Who fails says so, and claims nothing.
    assert!(failed * 1000 <= bounded);
}

#[test]
fn measurements_that_are_hard_to_compute_with_hold_the_truth() {
    run_hard(0..2_000);
}

#[test]
#[ignore = "twenty thousand networks"]
fn twenty_thousand_hard_networks_hold_the_truth() {
    run_hard(2_000..22_000);
}
